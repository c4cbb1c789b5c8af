"""Plays trials on a Ray cluster: each is a task, placed on a free processor and repeated if its node dies.

A task plays its trial like a campaign on one machine: in its own process, forked from a preloaded one. The folders
of the scenarios travel with the tasks, for nodes without those files; the artifacts of failed trials come back.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import NamedTuple, Protocol

import msgspec

from roboglot.extras import explaining
from roboglot.shards.joining import LOCAL, joined
from roboglot.shards.ray_processes import RayProcesses
from roboglot.testing.campaign.local import ATTEMPTS_MAX, Ended, Leave, interruptions, play_here
from roboglot.testing.campaign.trials import Outcome, Result, Trial
from roboglot.testing.scenarios.files import shown_below

with explaining("--on", "fleet"):
    import ray

FILES_MAX, BYTES_MAX = 2000, 64 << 20  # of a campaign's scenarios, and of one trial's results
LOOK_SECONDS = 0.5  # between two checks for Ctrl-C
Files = dict[str, bytes]


class TooLarge(ValueError):
    """The folder is too large to send over the network."""


class Reference(Protocol):
    """Ray's result of a task."""

    def future(self) -> Future[tuple[bytes, Files]]:
        """Return a future of the task's result."""


class _Begun(NamedTuple):
    """A trial that is a task now; ``place``: folder for its artifacts."""

    trial: Trial
    attempt: int
    place: Path | None


def play_on(
    where: str,
    trials: Iterator[Trial],
    paths: Iterable[Path],
    workers: int,
    seconds_max: float,
    leave: Leave,
    ended: Ended,
) -> None:
    """Play ``trials`` on the cluster ``where``, ``workers`` at a time; 0: one per processor.

    ``paths``: files and folders that they need. Raises KeyboardInterrupt at SIGINT, once running trials are
    cancelled; OSError if there is no such cluster, or no longer; TooLarge.
    """
    waiting: dict[Reference, _Begun] = {}
    files: object = None
    with joined(where), interruptions() as interrupted:
        task = ray.remote(_play).options(num_cpus=1, max_retries=0)  # tried again here, where attempts are counted
        processes, workers = RayProcesses(), workers or max(1, int(ray.cluster_resources().get("CPU", 1)))

        def begin(trial: Trial, attempt: int) -> None:
            nonlocal files
            files = files or ray.put({} if where == LOCAL else pack(Path(trial.folder), paths))
            place = leave(trial)
            waiting[task.remote(trial, files, seconds_max, keep=place is not None)] = _Begun(trial, attempt, place)

        while not interrupted.poll():
            if why := processes.why_lost():
                raise OSError(why)
            while len(waiting) < workers and (trial := next(trials, None)) is not None:
                begin(trial, 1)
            if not waiting:
                return
            done, _ = ray.wait(list(waiting), timeout=LOOK_SECONDS)
            for reference in done:
                begun = waiting.pop(reference)
                if (result := _result(reference, begun)) is None:
                    begin(begun.trial, begun.attempt + 1)
                else:
                    ended(begun.trial, result)
        for reference in waiting:
            ray.cancel(reference)
        ray.wait(list(waiting), num_returns=len(waiting), timeout=10.0)
    raise KeyboardInterrupt


def _result(reference: Reference, begun: _Begun) -> Result | None:
    """Return the result of a task that is done; None if its process or node died, and it shall be tried again."""
    try:
        encoded, left = ray.get(reference)
    except ray.exceptions.RayError as error:
        own = isinstance(error, ray.exceptions.RayTaskError)  # raised by the task, and would be again
        if not own and begun.attempt < ATTEMPTS_MAX:
            return None
        return Result(Outcome.CRASHED, str(error).strip().splitlines()[0], attempts=begun.attempt)
    if begun.place is not None:
        unpack(left, begun.place)
    result = msgspec.json.decode(encoded, type=Result)
    return msgspec.structs.replace(result, attempts=begun.attempt - 1 + result.attempts)


def _play(trial: Trial, files: Files, seconds_max: float, *, keep: bool) -> tuple[bytes, Files]:
    """Play one trial on a node; return its encoded result and, with ``keep``, its artifacts."""
    results: list[Result] = []
    with tempfile.TemporaryDirectory(prefix="roboglot-task-") as folder:
        scenarios, left = Path(trial.folder), Path(folder, "left")
        if not _as_here(files, scenarios):
            scenarios = Path(folder, "scenarios")
            unpack(files, scenarios)
        here = Trial(str(scenarios), trial.scenario, trial.name, trial.seed, trial.fingerprint)
        play_here(
            iter([here]), 1, seconds_max, lambda _: left if keep else None, lambda _, result: results.append(result)
        )
        try:
            kept = pack(left, [left]) if keep and left.exists() else {}
        except TooLarge:
            kept = {}
    return msgspec.json.encode(results[0]), kept


def _as_here(files: Files, folder: Path) -> bool:
    """Return whether this machine has the same files in ``folder``, and thus the files that they refer to."""
    places = ((folder / name, content) for name, content in files.items())
    return all(place.is_file() and place.read_bytes() == content for place, content in places)


def pack(folder: Path, paths: Iterable[Path]) -> Files:
    """Return the files below ``paths`` by their path below ``folder``. Raises TooLarge."""
    packed: Files = {}
    size = 0
    for path in paths:
        for file in sorted(shown_below(path)):
            if not file.is_file():
                continue
            size += file.stat().st_size
            if size > BYTES_MAX or len(packed) >= FILES_MAX:
                raise TooLarge(f"{path}: at most {FILES_MAX} files and {BYTES_MAX >> 20} MB travel to a cluster")
            packed[str(file.relative_to(folder))] = file.read_bytes()
    return packed


def unpack(files: Files, folder: Path) -> None:
    """Write packed files below ``folder``."""
    for name, content in files.items():
        file = folder / name
        if not file.resolve().is_relative_to(folder.resolve()):
            raise ValueError(f"{name} is not below the folder")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
