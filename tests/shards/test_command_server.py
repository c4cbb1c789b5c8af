"""Commands to a fleet that fail say why, and leave every shard as its stored plan has it."""

from __future__ import annotations

import asyncio
import errno
import shutil
import sqlite3
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from roboglot.shards import moving
from roboglot.shards.command_server import CommandServer
from roboglot.shards.plan import load, plan_fleet
from roboglot.shards.requests import Answer, Request, Verb
from roboglot.shards.states import FleetEnds, Shard, Shards, State

FULL = OSError(errno.ENOSPC, "No space left on device", "/data/fleet.json")


class Host(SimpleNamespace):
    """A fleet of two worlds with two robots each that notes which shards were restarted."""

    def __init__(self, folder: Path, **template: object) -> None:
        plan = plan_fleet(2, 2, template, folder, first="127.16.4.1")
        shards = Shards(plan, folder)
        super().__init__(plan=plan, folder=folder, shards=shards, nursery=0, stores_here=True, restarted=[], broken=[])

    async def stop(self, shard: Shard) -> None:
        """Stop a shard."""
        self.shards.turn_to(shard, State.STOPPED)

    async def restart(self, shard: Shard) -> None:
        """Note a restart; a broken shard fails."""
        self.restarted.append(shard.plan.name)
        if shard.plan.name in self.broken:
            shard.reason = "127.16.4.1:1448 is in use"
            self.shards.turn_to(shard, State.FAILED)


@pytest.fixture
async def host(tmp_path: Path) -> Host:
    (tmp_path / "shards/w1/data").mkdir(parents=True)
    return Host(tmp_path)


async def error_of(host: Any, request: Request) -> str:
    server = CommandServer(host, host.folder)
    return msgspec.json.decode(await server._answer(msgspec.json.encode(request)), type=Answer).error


def failing(error: Exception) -> Any:
    def fail(*_: object, **__: object) -> None:
        raise error

    return fail


async def test_reset_that_cannot_delete_says_so(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "rmtree", failing(PermissionError(errno.EACCES, "Permission denied", "/data/w1")))
    assert await error_of(host, Request("reset", "w1")) == "/data/w1: Permission denied"
    assert host.restarted == ["w1"]


async def test_reset_of_a_shard_without_data_succeeds(host: Host) -> None:
    assert await error_of(host, Request("reset", "w2")) == ""
    assert host.restarted == ["w2"]


async def test_reset_does_not_claim_to_clear_a_database(host: Host) -> None:
    host.shards["w1"].plan.settings["database"] = "postgresql://127.0.0.1/robots"
    assert "store in the database" in await error_of(host, Request("reset", "w1"))
    assert host.restarted == []


async def test_move_that_cannot_be_stored_is_undone(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    before = msgspec.json.encode(host.plan.shards)
    robot = host.shards["w1"].plan.robots[0]
    monkeypatch.setattr(moving, "save", failing(FULL))
    assert await error_of(host, Request("move", robot=robot, to="w2")) == "/data/fleet.json: No space left on device"
    assert msgspec.json.encode(host.plan.shards) == before
    assert sorted(host.restarted) == ["w1", "w2"]


async def test_move_on_a_full_disk_says_so(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = host.shards["w1"].plan.robots[0]
    monkeypatch.setattr(moving, "copy_robot", failing(sqlite3.OperationalError("database or disk is full")))
    assert await error_of(host, Request("move", robot=robot, to="w2")) == "database or disk is full"


@pytest.mark.parametrize(
    ("request_", "done"),
    [
        (Request("restart", "w1"), ""),
        (Request("restart"), ""),
        (Request("reset", "w1"), "its data is deleted, but "),
        (Request("move", robot="a1", to="w2"), "a1 is in w2 now, but "),
        (Request("move", robot="a2", to="w1"), "a2 is in w1 now, but "),
    ],
    ids=lambda value: value.do if isinstance(value, Request) else "",
)
async def test_a_shard_that_stays_down_is_reported(host: Host, request_: Request, done: str) -> None:
    host.broken.append("w1")
    assert await error_of(host, request_) == f"{done}w1 is down: 127.16.4.1:1448 is in use"
    assert await error_of(host, Request("look")) == await error_of(host, Request("stop", "w1")) == ""


async def test_a_failed_move_reports_shards_too(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    host.broken.append("w2")
    monkeypatch.setattr(moving, "save", failing(FULL))
    failed = await error_of(host, Request("move", robot="a1", to="w2"))
    assert failed == "/data/fleet.json: No space left on device; w2 is down: 127.16.4.1:1448 is in use"


async def test_a_moved_robot_stays_despite_old_rows(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moving, "forget_robot", failing(sqlite3.OperationalError("database or disk is full")))
    assert await error_of(host, Request("move", robot="a1", to="w2")) == (
        "a1 is in w2, but w1 keeps a copy of its data: database or disk is full"
    )
    stored = load(host.folder)
    assert stored is not None
    assert stored.home_of("a1").name == host.plan.home_of("a1").name == "w2"
    assert sorted(host.restarted) == ["w1", "w2"]


@pytest.mark.parametrize("verb", ["stop", "restart", "move"])
async def test_commands_end_when_the_fleet_does(host: Host, verb: Verb, monkeypatch: pytest.MonkeyPatch) -> None:
    """One waits for a shard that the closing fleet starts no more; another waits for its turn."""

    async def for_ever(_: object) -> None:
        await host.shards.until(lambda: False)

    monkeypatch.setattr(host, "stop", for_ever)
    monkeypatch.setattr(host, "restart", for_ever)
    server = CommandServer(host, host.folder)
    line = msgspec.json.encode(Request(verb, "w1", robot="a1", to="w2"))
    waiting = [asyncio.create_task(server._answer(line)) for _ in range(2)]
    await asyncio.sleep(0)
    async with asyncio.timeout(10.0):
        await server.close()
        answers = [msgspec.json.decode(await answer, type=Answer).error for answer in waiting]
    assert answers == ["the fleet ends", "the fleet ends"]
    assert host.plan.home_of("a1").name == "w1"
    with pytest.raises(FleetEnds):
        await host.shards.settle()


async def test_a_move_in_progress_ends_before_the_fleet(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else another program may run the robot in its old world while the plan and the rows change."""
    copying, done = threading.Event(), threading.Event()

    def copy(*_: object) -> None:
        copying.set()
        done.wait(10.0)

    monkeypatch.setattr(moving, "copy_robot", copy)
    server = CommandServer(host, host.folder)
    moved = asyncio.create_task(server._answer(msgspec.json.encode(Request("move", robot="a1", to="w2"))))
    await asyncio.to_thread(copying.wait, 10.0)
    closing = asyncio.create_task(server.close())
    await asyncio.sleep(0)
    assert not closing.done()
    done.set()
    await closing
    assert msgspec.json.decode(await moved, type=Answer).error == ""
    assert host.plan.home_of("a1").name == "w2"
