"""Members and apps: what was acknowledged is there again; what makes no sense is refused."""

from __future__ import annotations

import asyncio
import io
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.members import MEMBERS_MAX, NAME_MAX, PRINT_MAX
from roboglot.model.components.system.apps import APPS_MAX, Apps
from roboglot.model.components.system.bluetooth import Bluetooth
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import Firmware, FirmwarePackage
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.events import EventStream, MembersChanged
from roboglot.model.robot import Robot
from roboglot.storage.database import Database
from roboglot.storage.members import StoredMembers


@pytest.fixture
async def database(tmp_path: Path) -> AsyncIterator[Database]:
    opened = Database(tmp_path / "robot.db")
    yield opened
    opened.close()


def members_of(database: Database, robot: str = "a", events: EventStream | None = None) -> StoredMembers:
    return StoredMembers(database, robot, LockstepClock(), events or EventStream())


def robot_of(database: Database, clock: LockstepClock) -> Robot:
    """Return a dog in the office."""
    fleet = build_fleet("office", [RobotConfig(name="a", body="cyberdog2")], clock=clock, seed=1, database=database)
    fleet.world.start()
    return fleet.robots["a"]


async def test_members_are_there_again(database: Database) -> None:
    events = EventStream()
    changes = events.subscribe(MembersChanged)
    members = members_of(database, events=events)
    anna = await members.add("Anna", host=True)
    await members.add("小明")
    await members.set_face("Anna", b"face")
    await members.set_voice("小明", b"voice")
    await members.rename("小明", "Ming")
    assert len(changes.drain()) == 5
    again = members_of(database)
    assert [(m.name, m.host, m.face, m.voice) for m in again.all()] == [
        ("Anna", True, b"face", None),
        ("Ming", False, None, b"voice"),
    ]
    assert again.get("Anna").id == anna.id
    await again.set_face("Anna", None)
    await again.remove("Ming")
    assert [(m.name, m.face) for m in members_of(database).all()] == [("Anna", None)]
    assert not members_of(database, "another").all()


async def test_members_that_make_no_sense(database: Database) -> None:
    members = members_of(database)
    await members.add("Anna")
    for name in ("", "  ", "Anna", "x" * (NAME_MAX + 1), "a\nb"):
        with pytest.raises(InvalidGoal):
            await members.add(name)
    await members.add("Bob")
    with pytest.raises(InvalidGoal):
        await members.rename("Bob", "Anna")
    for print_ in (b"", b"x" * (PRINT_MAX + 1)):
        with pytest.raises(InvalidGoal):
            await members.set_face("Bob", print_)
    for change in (members.remove("C"), members.rename("C", "D"), members.set_voice("C", b"v")):
        with pytest.raises(NotFound):
            await change
    for number in range(MEMBERS_MAX - 2):
        await members.add(f"m{number}")
    with pytest.raises(InvalidGoal):
        await members.add("one more")


async def test_apps_take_room_and_are_there_again(database: Database) -> None:
    clock = LockstepClock()
    robot = robot_of(database, clock)
    apps, disk = robot[Apps], robot[Disk]
    free = disk.free
    await apps.install("com.example.b", "1.0", io.BytesIO(b"x" * 1000))
    await apps.install("com.example.a", "2.0", io.BytesIO(b"x" * 500))
    await apps.install("com.example.b", "1.1", io.BytesIO(b"x" * 2000))
    assert [(app.name, app.version, app.size) for app in apps.all()] == [
        ("com.example.a", "2.0", 500),
        ("com.example.b", "1.1", 2000),
    ]
    assert disk.free == free - 2500
    later = robot_of(database, LockstepClock())
    assert later[Apps].all() == apps.all()
    assert later[Disk].free == free - 2500
    await later[Apps].remove("com.example.b")
    assert later[Disk].free == free - 500
    with pytest.raises(NotFound):
        await later[Apps].remove("com.example.b")


async def test_apps_that_are_refused(database: Database) -> None:
    robot = robot_of(database, LockstepClock())
    apps = robot[Apps]
    for name, package in (("", b"x"), ("a", b""), ("a\0", b"x"), ("a" * 300, b"x")):
        with pytest.raises(InvalidGoal):
            await apps.install(name, "1", io.BytesIO(package))
    robot[Disk].take("everything", robot[Disk].free)
    with pytest.raises(Refused):
        await apps.install("a", "1", io.BytesIO(b"x"))
    assert not apps.all()
    robot[Disk].release("everything")
    for number in range(APPS_MAX):
        await apps.install(f"a{number}", "1", io.BytesIO(b"x"))
    with pytest.raises(InvalidGoal):
        await apps.install("one more", "1", io.BytesIO(b"x"))


@pytest.mark.slow
async def test_firmware_history_and_switches_survive(database: Database) -> None:
    clock = LockstepClock()
    robot = robot_of(database, clock)
    digest = "0" * 32
    package = FirmwarePackage("9.0", 1_000_000, digest, {"motors.MCU_Motor": "9"})
    for begin, seconds in (
        (lambda: robot[Firmware].download(package), 0.1),
        (lambda: robot[Firmware].install(digest), 1.0),
        (robot[Firmware].reboot, 30.0),
        (lambda: robot[Bluetooth].connect("C4:7C:8D:00:00:02"), 5.0),
    ):
        action = begin()
        await clock.advance(seconds)
        assert await action.done() is ActionStatus.SUCCEEDED
    await robot[Firmware].set_automatic(True)
    await robot[Power].set_automatic(True)
    later = robot_of(database, LockstepClock())
    assert (later[Firmware].version, later[Firmware].automatic, later[Power].automatic) == ("9.0", True, True)
    assert later[Firmware].modules["motors.MCU_Motor"] == "9"
    assert later[Bluetooth].history == robot[Bluetooth].history


async def test_members_changed_at_once_are_stored_so(database: Database) -> None:
    members = members_of(database)
    for name in ("anna", "ben", "eva"):
        await members.add(name)
    outcomes = await asyncio.gather(
        members.remove("anna"),
        members.rename("anna", "ann"),
        members.rename("ben", "bob"),
        members.rename("ben", "benno"),
        members.set_face("eva", b"face"),
        members.rename("eva", "eve"),
        return_exceptions=True,
    )
    assert [isinstance(outcome, NotFound) for outcome in outcomes] == [False, True, False, True, False, False]
    assert [(member.name, member.face) for member in members.all()] == [("bob", None), ("eve", b"face")]
    assert members.all() == members_of(database).all()


async def test_apps_changed_at_once_keep_their_room(database: Database) -> None:
    robot = robot_of(database, LockstepClock())
    apps, disk = robot[Apps], robot[Disk]
    free = disk.free
    await apps.install("tour", "1.0", io.BytesIO(b"x" * 1000))
    await asyncio.gather(apps.remove("tour"), apps.install("tour", "1.1", io.BytesIO(b"x" * 2000)))
    assert [app.version for app in apps.all()] == ["1.1"]
    assert disk.free == free - 2000
