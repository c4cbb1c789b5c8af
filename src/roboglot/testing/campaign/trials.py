"""One scenario with one seed: the trial, its result, and its play in a process."""

from __future__ import annotations

import codecs
import hashlib
import os
import tempfile
from collections.abc import Iterator, Sequence
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path

import msgspec

from roboglot.testing.scenarios.files import Found, read, with_seed
from roboglot.values import dataclass

WHY_MAX = 500  # characters kept of a reason


class Outcome(StrEnum):
    """Outcome of a trial."""

    PASSED = "passed"
    FAILED = "failed"  # an expectation was not met
    BROKEN = "broken"  # the scenario could not be played
    CRASHED = "crashed"  # its process died every time
    LATE = "late"  # stopped after the time limit of a trial


FINAL = (Outcome.PASSED, Outcome.FAILED, Outcome.BROKEN)  # playing it again would give the same result


@dataclass(frozen=True, slots=True)
class Trial:
    """``scenario``: path below ``folder``; ``fingerprint``: hash of the scenario, its files and roboglot's version."""

    folder: str
    scenario: str
    name: str
    seed: int
    fingerprint: str

    @property
    def label(self) -> str:
        """``scenario`` for tables and reports: bytes of a file's name that are not UTF-8 are written out.

        So backslashes are doubled; ``named`` returns the name.
        """
        return os.fsencode(self.scenario).replace(b"\\", b"\\\\").decode("utf-8", "backslashreplace")


def named(label: str) -> str:
    """Return the file's name that a label stands for."""
    return os.fsdecode(codecs.escape_decode(label.encode())[0])


class Result(msgspec.Struct, frozen=True):
    """Result of a trial; ``seconds`` are real ones."""

    outcome: Outcome
    why: str = ""
    seconds: float = 0.0
    attempts: int = 1


def trials_of(found: Sequence[Found], folder: Path, seeds: range) -> Iterator[Trial]:
    """Yield every scenario with every seed, seed by seed, so that a campaign stopped early has all scenarios."""
    prints = [_fingerprint(each) for each in found]
    for seed in seeds:
        for each, fingerprint in zip(found, prints, strict=True):
            name = str(each.path.relative_to(folder))
            yield Trial(str(folder), name, each.scenario.name, seed, fingerprint)


def _fingerprint(found: Found) -> str:
    """Return a hash of a scenario's text, world, recording and programs, and of roboglot's version."""
    digest = hashlib.sha256(version("roboglot").encode() + found.path.read_bytes())
    given, folder = found.scenario.given, found.path.parent
    for name in (given.world, given.recording, *(step.program for step in found.scenario.when)):
        if name and (folder / name).is_file():
            digest.update((folder / name).read_bytes())
    return digest.hexdigest()[:12]


def play_trial(trial: Trial, leave: Path | None) -> Result:
    """Play a trial in this process; artifacts of a failed one go below ``leave``, if given."""
    from roboglot.testing.scenarios.runner import play

    found = with_seed(read(Path(trial.folder) / trial.scenario), trial.seed)
    with tempfile.TemporaryDirectory(prefix="roboglot-trial-") as thrown_away:
        played = play(found, leave or Path(thrown_away))
    why = "; ".join(played.failures)[:WHY_MAX]
    if played.broken:
        return Result(Outcome.BROKEN, why, played.seconds)
    return Result(Outcome.FAILED if why else Outcome.PASSED, why, played.seconds)
