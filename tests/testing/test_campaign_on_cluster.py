"""Trials of a campaign as Ray's tasks: attempts are counted, and with Ray the campaign ends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from types import SimpleNamespace

import msgspec
import pytest

pytest.importorskip("ray", reason="Ray, which roboglot's extra `fleet` brings, is not installed")

import ray
from ray.exceptions import NodeDiedError, WorkerCrashedError

from roboglot.testing.campaign import cluster as campaigns
from roboglot.testing.campaign.trials import Outcome, Result, Trial
from tests.shards.children import child

# Ray's own threads leave sockets and files to the collector.
pytestmark = pytest.mark.filterwarnings("ignore")


class Tasks:
    """Stand-in for Ray: tasks of a campaign, which end with one of ``ends`` after the other."""

    exceptions = ray.exceptions

    def __init__(self, ends: Iterable[Exception | Result]) -> None:
        self.begun = 0
        self._ends = iter(ends)

    def remote(self, _: object) -> SimpleNamespace:
        return SimpleNamespace(options=lambda **_: SimpleNamespace(remote=self._begin))

    def _begin(self, *_: object, **__: object) -> object:
        self.begun += 1
        return object()

    def cluster_resources(self) -> dict[str, float]:
        return {"CPU": 1.0}

    def put(self, files: object) -> object:
        return files

    def wait(self, waiting: list[object], **_: object) -> tuple[list[object], list[object]]:
        return waiting, []

    def get(self, _: object) -> tuple[bytes, dict[str, bytes]]:
        end = next(self._ends)
        if isinstance(end, Exception):
            raise end
        return msgspec.json.encode(end), {}


def played(tasks: Tasks, seeds: int, monkeypatch: pytest.MonkeyPatch) -> list[Result]:
    """Play a trial with each of ``seeds`` seeds by these tasks; return the results."""
    results = list[Result]()
    monkeypatch.setattr(campaigns, "ray", tasks)
    monkeypatch.setattr(campaigns, "joined", lambda _: nullcontext())
    trials = (Trial("/", "a.yaml", "a", seed, "f") for seed in range(seeds))
    campaigns.play_on("local", trials, [], 1, 60.0, lambda _: None, lambda _, result: results.append(result))
    return results


@pytest.mark.parametrize(
    ("ends", "outcome", "attempts"),
    [
        ([Result(Outcome.PASSED)], Outcome.PASSED, 1),
        ([WorkerCrashedError(), Result(Outcome.FAILED, "no")], Outcome.FAILED, 2),
        ([WorkerCrashedError(), Result(Outcome.PASSED, attempts=2)], Outcome.PASSED, 3),
        ([WorkerCrashedError(), NodeDiedError("gone"), WorkerCrashedError()], Outcome.CRASHED, 3),
    ],
)
def test_attempts_count_tasks_whose_process_died(
    ends: list[Exception | Result], outcome: Outcome, attempts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    (result,) = played(Tasks(ends), 1, monkeypatch)
    assert (result.outcome, result.attempts) == (outcome, attempts)


def test_a_task_that_fails_is_not_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk of its node, say."""
    tasks = Tasks([ray.exceptions.RayTaskError("_play", "OSError: No space left on device", OSError())])
    (result,) = played(tasks, 1, monkeypatch)
    assert (result.outcome, result.attempts, tasks.begun) == (Outcome.CRASHED, 1, 1)


def test_a_lost_ray_ends_a_campaign(monkeypatch: pytest.MonkeyPatch) -> None:
    with child("raylet") as process:

        def ends() -> Iterator[Result]:
            process.kill()
            process.wait()
            yield Result(Outcome.PASSED)

        tasks = Tasks(ends())
        with pytest.raises(OSError, match=r"^raylet, a process of Ray, has ended, and Ray with it; start again$"):
            played(tasks, 2, monkeypatch)
        assert tasks.begun == 1
