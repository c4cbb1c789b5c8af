"""Commands to a fleet that fail say why, and leave every shard as its stored plan has it."""

from __future__ import annotations

import errno
import shutil
import sqlite3
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from roboglot.shards import moving
from roboglot.shards.command_server import CommandServer
from roboglot.shards.plan import plan_fleet
from roboglot.shards.requests import Answer, Request
from roboglot.shards.states import Shard

FULL = OSError(errno.ENOSPC, "No space left on device", "/data/fleet.json")


class Host(SimpleNamespace):
    """A fleet of two worlds with two robots each that notes which shards were restarted."""

    def __init__(self, folder: Path, **template: object) -> None:
        plan = plan_fleet(2, 2, template, folder, first="127.16.4.1")
        shards = {p.name: Shard(number, p, folder) for number, p in enumerate(plan.shards, start=1)}
        super().__init__(plan=plan, folder=folder, shards=shards, nursery=0, stores_here=True, restarted=[])

    async def stop(self, shard: Shard) -> None:
        """Stop a shard."""

    async def restart(self, shard: Shard) -> None:
        """Note a restart."""
        self.restarted.append(shard.plan.name)


@pytest.fixture
def host(tmp_path: Path) -> Host:
    host = Host(tmp_path)
    Path(host.shards["w1"].plan.settings["data"]).mkdir(parents=True)
    return host


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
