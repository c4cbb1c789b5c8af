"""Supervisor of shards that refuse, die, grow, or wait for their turn; without processes."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
from collections.abc import AsyncIterator, Callable
from functools import partial
from pathlib import Path

import pytest

from roboglot.shards import supervisor as module
from roboglot.shards.messages import Beat, News, Ready, Refusal, encode, pair
from roboglot.shards.plan import PLAN, plan_fleet
from roboglot.shards.shard import SETTINGS
from roboglot.shards.states import FleetEnds, Shard, State
from roboglot.shards.supervisor import REPORT_MAX, STALE, STARTING_MAX, Supervisor


class FakeNursery:
    """A nursery whose shards do what the test says."""

    def __init__(self, born: Callable[[int, int], None], dead: Callable[[int, int], None], *_: object) -> None:
        self.born, self.dead, self.pid = born, dead, 1
        self.links: dict[int, socket.socket] = {}
        self.forked: list[int] = []
        self.ended: list[tuple[int, int]] = []
        self.killed = 0

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

    def kill(self) -> None:
        self.killed += 1

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
    assert first(supervisor).reason == "it ended with status 1", "not that of an earlier end"


async def test_reason_is_that_of_the_last_end(supervisor: Supervisor) -> None:
    nursery_of(supervisor).say(1, Refusal("127.10.0.1:1448 is in use", lasting=False))
    nursery_of(supervisor).die(1, 1)
    assert first(supervisor).reason == "127.10.0.1:1448 is in use"
    await supervisor.shards.until(lambda: nursery_of(supervisor).forked.count(1) == 2)
    nursery_of(supervisor).die(1, -signal.SIGKILL)
    assert first(supervisor).reason == "killed by SIGKILL"


async def test_one_with_wrong_settings_is_not_retried(supervisor: Supervisor) -> None:
    nursery_of(supervisor).say(1, Refusal("there is no world 'moon'", lasting=True))
    nursery_of(supervisor).die(1, 1)
    shard = first(supervisor)
    assert (shard.state, shard.reason, shard.again) == (State.FAILED, "there is no world 'moon'", None)
    await supervisor.stop(shard)
    assert shard.reason == "", "one that was stopped by request has no other reason"


async def test_a_reason_of_all_is_logged_once(supervisor: Supervisor, caplog: pytest.LogCaptureFixture) -> None:
    supervisor.shards.report_hopeless()
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


async def test_one_that_is_silent_is_not_called_fast(supervisor: Supervisor) -> None:
    shard = first(supervisor)
    supervisor.shards.turn_to(shard, State.READY)
    shard.beat = Beat(1.0, 1 << 20, 1.0)
    for silent, factor in ((STALE - 1.0, 1.0), (STALE + 1.0, 0.0)):
        shard.heard = shard.since = asyncio.get_running_loop().time() - silent
        supervisor._look_after()
        assert shard.beat == Beat(factor, 1 << 20, 1.0)
        assert shard.trouble == ("" if factor else f"not answering for {silent:.0f} s")


async def test_one_that_is_silent_is_killed(supervisor: Supervisor, caplog: pytest.LogCaptureFixture) -> None:
    first(supervisor).heard = first(supervisor).since = -1e9
    supervisor._look_after()
    supervisor._look_after()
    assert nursery_of(supervisor).ended == [(1, signal.SIGKILL)] * 2
    assert len(caplog.records) == 1


@pytest.mark.parametrize("pid", [0, 2**22 + 1, os.getpid()], ids=["never reported", "gone", "cannot be killed"])
async def test_nursery_that_reports_no_end_is_killed(supervisor: Supervisor, pid: int) -> None:
    """A shard whose process is still there, as it waits for a disk, is not the nursery's fault."""
    shard = first(supervisor)
    shard.heard = shard.since = -1e9
    supervisor._look_after()
    shard.pid = pid
    supervisor._look_after()
    assert nursery_of(supervisor).killed == 0, "it has a moment to report the end"
    shard.killed_at -= REPORT_MAX
    supervisor._look_after()
    assert nursery_of(supervisor).killed == (pid != os.getpid())


async def test_one_that_has_ended_uses_nothing(supervisor: Supervisor) -> None:
    nursery_of(supervisor).say(1, Beat(1.0, 67 << 20, 3.0))
    nursery_of(supervisor).die(1, -signal.SIGKILL)
    assert (first(supervisor).beat, first(supervisor).pid) == (Beat(0.0, 0, 0.0), 0)


async def test_a_stop_ends_when_the_fleet_does(supervisor: Supervisor) -> None:
    stopping = asyncio.create_task(supervisor.stop(first(supervisor)))
    restarting = asyncio.create_task(supervisor.restart(supervisor.shards["w2"]))
    await asyncio.sleep(0)
    supervisor.shards.end()
    async with asyncio.timeout(10.0):
        ends = await asyncio.gather(stopping, restarting, return_exceptions=True)
    assert [type(end) for end in ends] == [FleetEnds, FleetEnds]


async def test_settings_are_their_owners_alone(supervisor: Supervisor) -> None:
    """A database's URL may hold a password."""
    for file in (supervisor.folder / PLAN, first(supervisor).folder / SETTINGS):
        assert file.stat().st_mode & 0o777 == 0o600


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
