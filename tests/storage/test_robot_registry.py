"""A robot has one program: leases, epochs and fencing, in a file and on a server."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import TypeVar, cast

import psycopg
import pytest

from roboglot.config import Config, ConsoleConfig, RobotConfig
from roboglot.model.action import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import Busy, RobotError
from roboglot.model.geometry import Twist
from roboglot.runtime import Runtime
from roboglot.storage import registry_lease as timing
from roboglot.storage.dead_programs import GAP_MAX, DeadProgramWatch
from roboglot.storage.opening import open_database
from roboglot.storage.registry_lease import HOLD, LEASE, PERIOD, RegistryLease, holder_of
from roboglot.storage.robot_registry import RobotRegistry, RobotsHeld
from roboglot.storage.transactions import Connection, DatabaseError, DiskFull, Transactions
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql

T = TypeVar("T")


class Watch:
    """A clock that stands until it is set."""

    now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Watch:
    clock, sleep = Watch(), asyncio.sleep

    async def pass_time(seconds: float) -> None:
        clock.now += seconds
        await sleep(0)

    monkeypatch.setattr(timing.asyncio, "sleep", pass_time)
    return clock


def leased(database: Transactions, holder: str, watch: Watch, lost: Callable[[str], None] = print) -> RegistryLease:
    return RegistryLease(RobotRegistry(database), {"a": f"127.1.0.1#{holder}", "b": "127.1.0.2"}, holder, lost, watch)


async def test_robot_of_a_silent_program_goes_to_next(database: Transactions, watch: Watch) -> None:
    lost = list[str]()
    old, new = leased(database, "old", watch, lost.append), leased(database, "new", watch)
    await old.acquire()
    assert not old.refusal("a")
    began = watch.now
    await new.acquire()
    assert watch.now == began + LEASE
    assert old.refusal("a")
    assert not new.refusal("a")
    old.check()
    assert lost == ["a", "b"]
    registry = await RobotRegistry(database).all()
    assert {(h.holder, h.epoch) for h in registry.values()} == {("new", 2)}
    assert registry["a"].address == "127.1.0.1#new"


async def test_old_program_never_comes_back_with_old_epoch(database: Transactions, watch: Watch) -> None:
    old, new = leased(database, "old", watch), leased(database, "new", watch)
    await old.acquire()
    await new.acquire()
    await old.renew()  # late: the registry answers with another epoch
    assert "another program" in old.refusal("a")
    await old.close()
    assert {h.holder for h in (await RobotRegistry(database).all()).values()} == {"new"}
    await new.renew()
    assert not new.refusal("a")


async def test_robot_that_is_renewed_is_refused_to_others(
    database: Transactions, watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, new = leased(database, "old", watch), leased(database, "new", watch)
    await old.acquire()

    async def renewed(seconds: float) -> None:
        watch.now += seconds
        await old.renew()

    monkeypatch.setattr(timing.asyncio, "sleep", renewed)
    with pytest.raises(OSError, match="another program runs robot a, b"):
        await new.acquire()
    assert new.refusal("a")
    assert not old.refusal("a")


async def test_program_that_wants_fewer_robots_releases_the_others(database: Transactions) -> None:
    """It was killed, and one of its robots was moved: its renewals must not hold that one for ever."""
    registry = RobotRegistry(database)
    await registry.take({"a": "", "b": ""}, "old", {})
    assert await registry.take({"b": ""}, "old", {}) == {"b": 2}
    await registry.renew("old")
    assert await registry.take({"a": ""}, "new", {}) == {"a": 2}


@pytest.mark.parametrize("failure", [DatabaseError("connection refused"), DiskFull("the disk is full")], ids=str)
@pytest.mark.parametrize("keeper", ["program", "fleet"])
async def test_failing_registry_is_logged_seldom_and_tried_again(
    keeper: str, failure: RobotError, watch: Watch, caplog: pytest.LogCaptureFixture
) -> None:
    tries = 0

    async def fail(*_: object) -> None:
        nonlocal tries
        tries += 1
        raise failure.again()

    broken = cast("RobotRegistry", SimpleNamespace(renew=fail, renewals=fail))
    if keeper == "program":
        trying = asyncio.create_task(RegistryLease(broken, {"a": ""}, "x", print, watch)._renew_periodically())
    else:
        trying = asyncio.create_task(DeadProgramWatch(broken, ["a"], watch).run())
    while tries < 5:
        await asyncio.wait((trying,), timeout=0)
        assert not trying.done() or trying.result()
    trying.cancel()
    warnings = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert warnings == [f"the registry of robots fails: {failure}"]


async def test_a_program_gives_up_before_another_may_begin(database: Transactions, watch: Watch) -> None:
    old = leased(database, "old", watch)
    await old.acquire()
    watch.now += HOLD
    assert "has not confirmed" in old.refusal("a")
    assert HOLD < LEASE
    await old.renew()  # the registry is back, and no one claimed them meanwhile
    assert not old.refusal("a")


async def test_robots_are_taken_at_once_all_or_none(database: Transactions, watch: Watch) -> None:
    old, began = leased(database, "old", watch), watch.now
    await old.acquire()
    await leased(database, "old", watch).acquire()  # the next program of the same folder
    await old.renew()
    assert "another program" in old.refusal("a")  # same holder, another epoch
    await old.close()  # an earlier epoch releases nothing
    registry = RobotRegistry(database)
    assert {h.holder for h in (await registry.all()).values()} == {"old"}
    await registry.release("old", {"a": 2})
    with pytest.raises(RobotsHeld) as held:
        await registry.take({"a": "", "b": ""}, "new", {})
    assert list(held.value.claims) == ["b"]
    assert (await registry.all())["a"].holder == ""
    assert await registry.take({"a": ""}, "new", {}) == {"a": 3}
    assert watch.now == began


@pytest.mark.slow
@needs_postgresql
async def test_robots_stand_while_the_server_is_away(db_server: PostgreSQLServer, watch: Watch) -> None:
    database, lost = open_database(Path(), db_server.url), list[str]()
    old = leased(database, "old", watch, lost.append)
    await old.acquire()
    db_server.stop()
    try:
        with pytest.raises(DatabaseError):
            await old.renew()
        old.check()
        assert not lost
        watch.now += HOLD
        old.check()
        assert lost == ["a", "b"]
    finally:
        db_server.start()
    await old.renew()
    assert not old.refusal("a")
    assert {h.epoch for h in (await RobotRegistry(database).all()).values()} == {1}
    database.close()


async def test_robot_that_another_program_took_stands_and_refuses(tmp_path: Path) -> None:
    registry = tmp_path / "registry.db"
    config = Config(
        world="empty",
        robots=(RobotConfig(body="universal", address="127.0.0.1"),),
        lockstep=True,
        data=tmp_path / "data",
        registry=str(registry),
        console=ConsoleConfig(enabled=False),
    )
    runtime = Runtime(config, ())
    database = open_database(registry)
    claims = RobotRegistry(database)
    await runtime.start()
    try:
        robot = runtime.fleet.robots["a"]
        driving = robot[Driving].drive(Twist(0.2, 0.0, 0.0))
        held = (await claims.all())["a"]
        assert held.holder == holder_of(config.data)
        await claims.take({"a": "10.0.0.2"}, "another", await claims.renewals())
        assert runtime._registry_lease is not None
        await runtime._registry_lease.renew()
        assert isinstance(runtime.clock, LockstepClock)
        await runtime.clock.advance(1.0)
        assert await driving.done() is ActionStatus.CANCELED
        with pytest.raises(Busy, match="another program"):
            robot[Driving].drive(Twist(0.2, 0.0, 0.0))
        robot[Driving].drive(Twist(0.0, 0.0, 0.0))  # stopping is always allowed
        await robot[Lease].take("person")  # control does not help, either
        with pytest.raises(Busy, match="another program"):
            robot[Driving].drive(Twist(0.2, 0.0, 0.0))
    finally:
        await runtime.close()
    assert (await claims.all())["a"].holder == "another"
    database.close()


NOTICED = 3.0  # s after which deploy/kuberay's cluster declares a node dead
STARTED = 2.0  # s that Ray then needs to start a shard's process
BACK_MAX = 10.0


async def watched(programs: DeadProgramWatch, watch: Watch, seconds: float) -> list[str]:
    """Look every period; return what was freed."""
    freed, end = list[str](), watch.now + seconds
    while watch.now < end:
        freed += await programs.check()
        watch.now += PERIOD
    return freed


async def test_robots_of_dead_shards_return_within_ten_seconds(database: Transactions, watch: Watch) -> None:
    old, new = leased(database, "old", watch), leased(database, "new", watch)
    programs = DeadProgramWatch(RobotRegistry(database), ["a", "b"], watch)
    await old.acquire()
    assert await watched(programs, watch, PERIOD) == []
    await old.renew()
    died = watch.now
    assert await watched(programs, watch, NOTICED + STARTED) == ["a", "b"]
    assert old.refusal("a")  # before another may claim it
    await new.acquire()
    assert watch.now - died <= NOTICED + STARTED + PERIOD
    assert watch.now - died < BACK_MAX
    assert {(h.holder, h.epoch) for h in (await RobotRegistry(database).all()).values()} == {("new", 2)}
    await old.renew()
    assert "another program" in old.refusal("a")


async def test_waiting_program_takes_robots_when_freed(
    database: Transactions, watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, new, registry = leased(database, "old", watch), leased(database, "new", watch), RobotRegistry(database)
    await old.acquire()
    began = watch.now

    async def freed_meanwhile(seconds: float) -> None:
        watch.now += seconds
        if watch.now - began > 1.0:
            await registry.free(await registry.renewals(), ["a", "b"])

    monkeypatch.setattr(timing.asyncio, "sleep", freed_meanwhile)
    await new.acquire()
    assert watch.now - began <= 1.0 + 2 * PERIOD
    assert not new.refusal("a")


async def test_only_silence_that_was_watched_frees(database: Transactions, watch: Watch) -> None:
    old, registry = leased(database, "old", watch), RobotRegistry(database)
    programs = DeadProgramWatch(registry, ["a"], watch)
    await old.acquire()
    for _ in range(20):  # it renews late
        await programs.check()
        watch.now += HOLD
        await old.renew()
        assert await programs.check() == []
    await watched(programs, watch, LEASE - 2 * PERIOD)
    watch.now += GAP_MAX + PERIOD  # the registry was out of reach, perhaps for the program, too
    assert await watched(programs, watch, LEASE) == []
    assert await watched(programs, watch, 2 * PERIOD) == ["a"]
    assert (await registry.all())["b"].holder == "old"  # another fleet's robots


async def test_renewal_that_comes_before_freeing_keeps_the_robot(database: Transactions, watch: Watch) -> None:
    old, registry = leased(database, "old", watch), RobotRegistry(database)
    await old.acquire()
    seen = await registry.renewals()
    await old.renew()
    assert await registry.free(seen, ["a", "b"]) == []
    assert {h.holder for h in (await registry.all()).values()} == {"old"}


async def test_freed_robot_returns_to_its_program_if_unclaimed(database: Transactions, watch: Watch) -> None:
    lost = list[str]()
    old, other = leased(database, "old", watch, lost.append), leased(database, "other", watch)
    registry = RobotRegistry(database)
    await old.acquire()
    watch.now += HOLD
    old.check()
    await registry.free(await registry.renewals(), ["a", "b"])
    await old.renew()
    assert not old.refusal("a")
    assert {(h.holder, h.epoch) for h in (await registry.all()).values()} == {("old", 2)}
    await registry.free(await registry.renewals(), ["a", "b"])
    await other.acquire()
    await other.close()  # what the robot stored then is unknown to the old program
    await old.renew()
    assert "another program" in old.refusal("a")
    assert lost == ["a", "b", "a", "b"]


class Held:
    """Keeps the transaction of a call open until it is released."""

    def __init__(self, database: Transactions) -> None:
        self._database, self.done, self.go = database, threading.Event(), threading.Event()

    async def run(self, work: Callable[[Connection], T]) -> T:
        def held(connection: Connection) -> T:
            result = work(connection)
            self.done.set()
            assert self.go.wait(20.0)
            return result

        return await self._database.run(held)


def wait_for_a_lock(url: str) -> None:
    """Return when a transaction waits for another's."""
    query, end = "SELECT count(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock'", time.monotonic() + 60.0
    with psycopg.connect(url, autocommit=True) as connection:
        while connection.execute(query).fetchone() == (0,):
            assert time.monotonic() < end
            connection.execute("SELECT pg_sleep(0.01)")


@needs_postgresql
@pytest.mark.parametrize("first", ["take", "renew"])
async def test_renewal_during_a_takeover_confirms_nothing(db_server: PostgreSQLServer, first: str) -> None:
    one, two = open_database(Path(), db_server.url), open_database(Path(), db_server.url)
    held = Held(one)
    slow, fast = RobotRegistry(cast(Transactions, held)), RobotRegistry(two)
    await fast.take({"a": "", "b": ""}, "old", {})
    renewals = await fast.renewals()
    calls = {
        "take": lambda registry: registry.take({"a": "", "b": ""}, "new", renewals),
        "renew": lambda registry: registry.renew("old"),
    }
    second = "renew" if first == "take" else "take"
    begun = asyncio.create_task(calls.pop(first)(slow))
    assert await asyncio.to_thread(held.done.wait, 20.0)
    meanwhile = asyncio.create_task(calls[second](fast))
    await asyncio.to_thread(wait_for_a_lock, db_server.url)
    held.go.set()
    if first == "take":
        assert await begun == {"a": 2, "b": 2}
        assert await meanwhile == {}
    else:
        assert await begun == {"a": 1, "b": 1}
        with pytest.raises(RobotsHeld):
            await meanwhile
    one.close()
    two.close()
