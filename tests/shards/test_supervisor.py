"""Supervisor of shards that refuse, die, grow, or wait for their turn; without processes."""

from __future__ import annotations

import asyncio
import signal
import socket
from collections.abc import AsyncIterator, Callable
from functools import partial
from pathlib import Path

import pytest

from roboglot.shards import supervisor as module
from roboglot.shards.messages import Beat, News, Ready, Refusal, encode, pair
from roboglot.shards.plan import plan_fleet
from roboglot.shards.states import Shard, State
from roboglot.shards.supervisor import STARTING_MAX, Supervisor


class FakeNursery:
    """A nursery whose shards do what the test says."""

    def __init__(self, born: Callable[[int, int], None], dead: Callable[[int, int], None], _: object) -> None:
        self.born, self.dead, self.pid = born, dead, 1
        self.links: dict[int, socket.socket] = {}
        self.forked: list[int] = []
        self.ended: list[tuple[int, int]] = []

    def open(self) -> None:
        pass

    async def warm(self) -> float:
        return 0.0

    def fork(self, number: int, folder: Path, log_file: int) -> socket.socket:  # noqa: ARG002
        ours, self.links[number] = pair()
        ours.setblocking(False)
        self.forked.append(number)
        self.born(number, 1000 + number)
        return ours

    def end(self, number: int, kind: int) -> None:
        self.ended.append((number, kind))

    async def close(self) -> None:
        for link in self.links.values():
            link.close()

    def say(self, number: int, message: News) -> None:
        self.links[number].send(encode(message))

    def die(self, number: int, status: int) -> None:
        self.links[number].close()
        self.dead(number, status)


@pytest.fixture
async def supervisor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Supervisor]:
    monkeypatch.setattr(module, "NurseryClient", FakeNursery)
    made = Supervisor(plan_fleet(STARTING_MAX + 2, 1, {}, tmp_path), tmp_path, memory_max=100 << 20)
    starting = asyncio.create_task(made.start())
    await made.shards.until(lambda: nursery_of(made).forked != [])
    yield made
    starting.cancel()
    await made.close()


def nursery_of(supervisor: Supervisor) -> FakeNursery:
    made = supervisor._nursery
    assert isinstance(made, FakeNursery)
    return made


def first(supervisor: Supervisor) -> Shard:
    return supervisor.shards["w1"]


async def test_few_start_at_a_time_then_the_next(supervisor: Supervisor) -> None:
    states = [shard.state for shard in supervisor.shards.values()]
    assert states == [State.STARTING] * STARTING_MAX + [State.WAITING] * 2
    nursery_of(supervisor).say(1, Ready({}))
    await supervisor.shards.until(lambda: len(nursery_of(supervisor).forked) == STARTING_MAX + 1)
    assert [shard.state for shard in supervisor.shards.values()].count(State.STARTING) == STARTING_MAX


async def test_dead_one_returns_at_growing_distances(
    supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "PAUSES", (0.0, 3600.0))
    nursery_of(supervisor).die(1, -signal.SIGKILL)
    await supervisor.shards.until(lambda: nursery_of(supervisor).forked.count(1) == 2)
    assert "shard w1 is down: killed by SIGKILL; it starts again at once" in caplog.text
    nursery_of(supervisor).die(1, 1)
    assert first(supervisor).state is State.FAILED
    assert first(supervisor).again is not None, "it is tried again"
    assert first(supervisor).reason == "killed by SIGKILL"


async def test_one_with_wrong_settings_is_not_retried(supervisor: Supervisor) -> None:
    nursery_of(supervisor).say(1, Refusal("there is no world 'moon'", lasting=True))
    nursery_of(supervisor).die(1, 1)
    shard = first(supervisor)
    assert (shard.state, shard.reason, shard.again) == (State.FAILED, "there is no world 'moon'", None)
    await supervisor.stop(shard)
    assert shard.reason == "", "one that was stopped by request has no other reason"


async def test_a_reason_of_all_is_logged_once(supervisor: Supervisor, caplog: pytest.LogCaptureFixture) -> None:
    for number in (1, 2):
        nursery_of(supervisor).say(number, Refusal("there is no world 'moon'", lasting=True))
        nursery_of(supervisor).die(number, 1)
    assert [record.getMessage() for record in caplog.records] == ["shard w1 cannot start: there is no world 'moon'"]


async def test_one_that_grows_too_large_is_restarted_orderly(supervisor: Supervisor) -> None:
    for number in range(2, STARTING_MAX + 1):
        nursery_of(supervisor).say(number, Ready({}))
    nursery_of(supervisor).say(1, Beat(1.0, 200 << 20, 1.0))
    nursery_of(supervisor).say(1, Ready({}))
    await supervisor.shards.until(
        lambda: [s.state for s in supervisor.shards.values()].count(State.READY) == STARTING_MAX
    )
    for number in (STARTING_MAX + 1, STARTING_MAX + 2):
        await supervisor.shards.until(partial(lambda number: number in nursery_of(supervisor).links, number))
        nursery_of(supervisor).say(number, Ready({}))
    supervisor._look_after()
    supervisor._look_after()
    assert nursery_of(supervisor).ended == [(1, signal.SIGTERM)], "once"
    nursery_of(supervisor).die(1, 0)
    await supervisor.shards.until(lambda: nursery_of(supervisor).forked.count(1) == 2)
    assert "200 MB of 100" in first(supervisor).reason


async def test_one_that_is_silent_is_killed(supervisor: Supervisor) -> None:
    first(supervisor).heard = first(supervisor).since = -1e9
    supervisor._look_after()
    assert (1, signal.SIGKILL) in nursery_of(supervisor).ended


async def test_stopping_one_that_waits_needs_no_process(supervisor: Supervisor) -> None:
    last = list(supervisor.shards.values())[-1]
    await supervisor.stop(last)
    assert last.state is State.STOPPED
    assert last.number not in nursery_of(supervisor).forked


async def test_start_does_not_wait_for_a_stopped_shard(supervisor: Supervisor) -> None:
    *others, last = supervisor.shards.values()
    await supervisor.stop(last)
    for shard in others:
        supervisor.shards.turn_to(shard, State.READY)
    await asyncio.wait_for(supervisor.shards.settle(), 5.0)
