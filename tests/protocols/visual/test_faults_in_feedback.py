"""Feedback to a front end when the robot's disk or its program engine fails."""

from __future__ import annotations

import os
import signal
import sqlite3
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, cast

import pytest

from roboglot.model.components.system.disk import Disk
from roboglot.model.robot import Robot
from roboglot.programs.engine import engine as engine_module
from roboglot.programs.engine.engine import Engine
from roboglot.storage.database import Database
from tests.protocols.visual.front_end import FrontEnd

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]


class Room:
    """A disk with so many bytes left."""

    free = 1


async def test_full_disk_means_list_that_cannot_be_updated(connect: Connect, plain_robot: Robot) -> None:
    database, disk = Database(":memory:"), Room()
    app = await connect(plain_robot, database.on(cast(Disk, disk)))
    assert (await app.save("kept", "pass"))["state"] == 0
    disk.free = 0
    feedback = await app.save("new", "pass")
    assert (feedback["state"], "disk is full" in feedback["describe"]) == (25, True)
    assert (await app.state("kept"), await app.state("new")) == ("wait_run", "null")
    [answer] = await app.ask("delete", "kept")
    assert (answer["state"], await app.state("kept")) == (0, "null")
    disk.free = 1
    assert (await app.save("new", "pass"))["state"] == 0
    await app.door.close()
    database.close()


async def test_broken_database_is_reported_in_the_same_way(
    connect: Connect, plain_robot: Robot, tmp_path: Path
) -> None:
    database = Database(tmp_path / "robot.db")
    app = await connect(plain_robot, database)
    with sqlite3.connect(tmp_path / "robot.db") as other:
        other.execute("ALTER TABLE program RENAME TO gone")
    other.close()
    feedback = await app.save("t", "pass")
    assert (feedback["state"], "no such table" in feedback["describe"]) == (25, True)
    with sqlite3.connect(tmp_path / "robot.db") as other:
        other.execute("ALTER TABLE gone RENAME TO program")
    other.close()
    assert (await app.save("t", "pass"))["state"] == 0
    await app.door.close()
    database.close()


async def test_engine_that_does_not_answer_is_time_out(
    app: FrontEnd, engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert (await app.save("t", "pass"))["state"] == 0
    assert engine._launcher is not None
    monkeypatch.setattr(engine_module, "ANSWER_MAX", 0.2)
    os.kill(engine._launcher.pid, signal.SIGSTOP)
    try:
        assert (await app.save("late", "late = 1"))["state"] == 31  # a text already judged is not judged again
        [answer] = await app.ask("run", "t")
        assert answer["state"] == 31
    finally:
        os.kill(engine._launcher.pid, signal.SIGCONT)
    monkeypatch.undo()
    assert (await app.state("late"), await app.state("t")) == ("null", "shutdown")
    await app.start("t", "while True:\n    pass\n")
    await app.ask("shutdown", "t")
