"""The owner of the machine sees who moves a robot, takes, gives and releases control; doors refuse in their words."""

import asyncio
import contextlib
import json
import stat
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from roboglot.cli.control import running
from roboglot.cli.control.lease import command, in_words
from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.control.lease_server import NAME, Answer, Control, LeaseServer, Request
from roboglot.hosting.local_socket import CALLERS_MAX, LINE_MAX
from roboglot.model.action import Action
from roboglot.model.client_context import acting_for
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.lease import TAKEN, Lease
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Busy, Refused
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Description, Robot
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.world.world import World
from roboglot.storage.database import Database
from roboglot.storage.settings import StoredSettings
from roboglot.testing import Forward
from roboglot.testing.addresses import free_addresses
from roboglot.wire.slamware.chapters.motion import AngleOptions

pytestmark = pytest.mark.world("empty")
ADDRESS = free_addresses(1)


async def _ask(path: Path, request: Request) -> Answer:
    return await running.exchange(path, request, Answer, 10.0)


@pytest.fixture
async def desk(robot: Robot, world: World, tmp_path: Path) -> AsyncIterator[Path]:
    """The desk's folder."""
    made = LeaseServer(tmp_path, world.robots, world.stage, ("robomaster", "console"))
    await made.open()
    yield tmp_path
    await made.close()
    assert not (tmp_path / NAME).exists()


async def say(folder: Path, line: bytes) -> Any:
    answer = b""
    async with asyncio.timeout(60):
        reader, writer = await asyncio.open_unix_connection(folder / NAME)
        with contextlib.suppress(ConnectionError):
            writer.write(line)
            answer = await reader.readline()
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
    return json.loads(answer) if answer else None


async def test_control_is_seen_taken_given_and_released(desk: Path, robot: Robot, forward: Forward) -> None:
    assert (await _ask(desk / NAME, Request())).robots[0].holder == ""
    robot[Driving].drive(Twist(x=0.2), source="test")
    await forward(seconds=1)
    (seen,) = (await _ask(desk / NAME, Request())).robots
    assert in_words(seen) == "a        moved by the robot itself (drive for 1 s); control is free"
    taking = asyncio.ensure_future(_ask(desk / NAME, Request("take", "a")))
    while not taking.done():
        await forward(seconds=0.1)
        await asyncio.sleep(0)
    (seen,) = (await taking).robots
    assert in_words(seen) == ("a        moved by no client, last by the robot itself; control is taken by a person")
    assert not robot.actions.running()
    (seen,) = (await _ask(desk / NAME, Request("give", "a", "robomaster"))).robots
    assert seen.taken_by == robot[Lease].taken_by == "robomaster"
    (seen,) = (await _ask(desk / NAME, Request("release", "a"))).robots
    assert in_words(seen).endswith("control is free")
    assert (await _ask(desk / NAME, Request("give", "a"))).error.startswith("a client's name")
    (seen,) = (await _ask(desk / NAME, Request("give", "a", "the robot itself"))).robots  # it moved last
    assert seen.taken_by == "the robot itself"
    assert (await _ask(desk / NAME, Request("take", "b"))).error == "there is no robot 'b'; there are a"


async def test_control_is_given_to_doors_that_exist_only(desk: Path, robot: Robot) -> None:
    answer = await _ask(desk / NAME, Request("give", "a", "robomastr 10.0.0.7"))
    assert answer.error == "there is no door 'robomastr'; did you mean 'robomaster'?"
    assert robot[Lease].taken_by == ""


async def test_only_owners_get_in_invalid_requests_are_reported(desk: Path) -> None:
    assert stat.S_IMODE((desk / NAME).stat().st_mode) == 0o600
    for line in (b"what?\n", b'{"do":"dance"}\n', b'{"does":1}\n', b"\xff\n", b'{"robot": "\xff"}\n'):
        assert (await say(desk, line))["error"]
    assert await say(desk, b"x" * (LINE_MAX * 4) + b"\n") is None
    waiting = [await asyncio.open_unix_connection(desk / NAME) for _ in range(CALLERS_MAX)]
    await asyncio.sleep(0)
    assert (await say(desk, b"{}\n"))["robots"]  # callers that ask nothing lock no other out
    assert await waiting[0][0].read() == b""  # the longest idle one gave way
    for _, writer in waiting:
        writer.close()
        await writer.wait_closed()
    assert (await say(desk, b"{}\n"))["robots"]


async def test_without_socket_robots_are_there_all_the_same(
    robot: Robot, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / ("long" * 30)
    folder.mkdir()
    made = LeaseServer(folder, {"a": robot})
    await made.open()
    assert "path is too long" in caplog.text
    await made.close()


def test_the_command_says_when_no_one_is_there(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="no `roboglot up` answers"):
        command(data=tmp_path)


def test_command_says_when_there_is_no_such_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def answer(name: str, request: Request, data: Path | None) -> Answer:
        return Answer([Control("a", "", "", 0.0, "", "", "")])

    monkeypatch.setattr("roboglot.cli.control.lease.send", answer)
    command("a", data=tmp_path)
    with pytest.raises(SystemExit, match="there is no robot 'b'; there are a"):
        command("b", data=tmp_path)


async def test_doors_refuse_in_their_words_and_name_clients(robot: Robot, forward: Forward) -> None:
    rest, text = (
        SlamwareDoor(robot, ADDRESS, SlamwareConfig(port=0)),
        RoboMasterDoor(
            robot, ADDRESS, RoboMasterConfig(control_port=0, event_port=0, video_port=0, audio_port=0, push_port=9)
        ),
    )
    await rest.start()
    await text.start()
    port = next(int(e.address.rpartition(":")[2]) for e in text.endpoints if "text SDK" in e.label)
    reader, writer = await asyncio.open_connection(ADDRESS, port)

    async def ask(command: str) -> str:
        writer.write(f"{command};".encode())
        async with asyncio.timeout(60):
            return (await reader.readuntil(b";")).decode()

    async with SlamwareClient(ADDRESS, rest.port, clock=robot.clock) as client:
        assert await ask("command") == "ok;"
        assert await ask("chassis speed x 0.1 y 0 z 0") == "ok;"
        await forward(seconds=0.2)
        holder = robot[Lease].holder
        assert holder
        assert holder.who == "robomaster {}:{}".format(*writer.get_extra_info("sockname"))
        await client.begin("RotateAction", AngleOptions(1.0))
        await forward(seconds=0.5)
        assert robot[Lease].last.who == "slamware 127.0.0.1"
        taking = asyncio.ensure_future(robot[Lease].take("robomaster"))
        await forward(seconds=1)
        await taking
        for action in ("RotateAction", "GoHomeAction"):  # a motion, and an errand of several motions
            with pytest.raises(SlamwareRefused) as refused:
                await client.begin(action, AngleOptions(1.0) if action == "RotateAction" else None)
            assert refused.value.code == 400
            assert refused.value.words == "Can not create action: control is taken by robomaster"
        assert (await client.get_robot_health()).has_warning
        assert await ask("chassis speed x 0.1 y 0 z 0") == "ok;"
        await robot[Lease].take("slamware 127.0.0.1")
        assert await ask("chassis move x 0.1") == "fail;"
        assert await ask("chassis speed x 0 y 0 z 0") == "ok;"
        await client.begin("RotateAction", AngleOptions(0.1))
    writer.transport.abort()
    await text.close()
    await rest.close()
    await forward(seconds=1)


async def test_control_survives_a_restart(tmp_path: Path) -> None:
    plate = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.2, height=0.3)

    @contextlib.asynccontextmanager
    async def server() -> AsyncIterator[tuple[Robot, Path]]:
        database = Database(tmp_path / "roboglot.db")
        robot = Robot("a", plate, LockstepClock())
        robot.add(Settings, StoredSettings(database, "a"))
        robot.add(Health, Health(robot.clock, robot.events))
        robot.add(Lease, Lease(robot))
        desk = LeaseServer(tmp_path, {"a": robot})
        await desk.open()
        try:
            yield robot, tmp_path / NAME
        finally:
            await desk.close()
            database.close()

    async with server() as (_, socket):
        assert (await _ask(socket, Request("give", "a", "robomaster"))).robots[0].taken_by == "robomaster"
    async with server() as (robot, socket):
        assert robot[Health].has(TAKEN)
        with acting_for("slamware 10.0.0.7"), pytest.raises(Busy, match="control is taken by robomaster"):
            robot.actions.start("drive", lambda _: asyncio.sleep(0), resources={BASE})
        assert (await _ask(socket, Request("release", "a"))).robots[0].taken_by == ""
    async with server() as (robot, _):
        assert robot[Lease].taken_by == ""
        assert not robot[Health].has(TAKEN)


@pytest.mark.world("empty", robots=("a", "b", "c"))
async def test_all_stop_and_all_are_taken_and_released(desk: Path, world: World, forward: Forward) -> None:
    for robot in world.robots.values():
        robot[Driving].drive(Twist(0.3, 0.0, 0.0), source="test")
    await forward(seconds=1.0)
    moving = [robot[Base].velocity.x for robot in world.robots.values()]
    assert min(moving) > 0.1
    stopping = asyncio.create_task(say(desk, b'{"do": "stop", "all": true}\n'))
    while not stopping.done():
        await forward(seconds=0.1)
    assert (await stopping)["error"] == ""
    assert max(abs(robot[Base].velocity.x) for robot in world.robots.values()) < 0.02
    taken = await say(desk, b'{"do": "take", "all": true}\n')
    assert all(row["taken_by"] for row in taken["robots"])
    freed = await say(desk, b'{"do": "release", "all": true}\n')
    assert not any(row["taken_by"] for row in freed["robots"])


@pytest.mark.world("empty", robots=("a", "b", "c", "d"))
async def test_refusing_robots_are_named_and_delay_no_other(
    desk: Path, world: World, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def refuse(reason: str) -> None:
        raise Refused("its link is gone")

    for name in ("a", "d"):
        monkeypatch.setattr(world.robot(name).actions, "cancel", refuse)
    for name in ("b", "c"):
        world.robot(name)[Driving].drive(Twist(0.3, 0.0, 0.0), source="test")
    await forward(seconds=1.0)
    stopping = asyncio.create_task(say(desk, b'{"do": "stop", "all": true}\n'))
    while not stopping.done():
        await forward(seconds=0.1)
    assert (await stopping)["error"] == "robot a: its link is gone; robot d: its link is gone"
    assert max(abs(world.robot(name)[Base].velocity.x) for name in ("b", "c")) < 0.02


async def test_a_real_robot_is_not_reset(world: World, clock: LockstepClock, tmp_path: Path) -> None:
    real = Robot("b", world.robot("a").description, clock)
    real.add(Lease, Lease(real))

    async def drive(_: Action) -> None:
        await asyncio.Event().wait()

    driving = real.actions.start("drive", drive, resources=(BASE,))
    server = LeaseServer(tmp_path, {**world.robots, "b": real}, world.stage)
    await server.open()
    assert (await _ask(tmp_path / NAME, Request("reset", "b"))).error == "robot b is in no simulated world"
    assert real.actions.running() == [driving]  # a refusal stops nothing
    await server.close()
    driving.cancel()
    await driving.done()


@pytest.mark.world("empty", robots=("a", "b"))
async def test_reset_puts_one_back_as_it_was(desk: Path, world: World, forward: Forward) -> None:
    start = world.truth.pose_of("a")
    battery = world.robot("a")[Battery]
    assert isinstance(battery, SimulatedBattery)
    charge = battery.charge
    battery.set_charge(0.1)
    battery.plug(True)
    world.stage.inject_fault("lidar_gone", "a")
    world.stage.place("a", start.compose(Pose(2.0, 1.0, 1.0)))
    await forward(seconds=0.5)
    assert (await say(desk, b'{"do": "reset", "robot": "a"}\n'))["error"] == ""
    await forward(seconds=0.5)
    assert world.truth.pose_of("a").distance_to(start) < 0.02
    assert battery.charge == pytest.approx(charge, abs=0.01)
    assert not world.stage.faults
    world.stage.place("a", start.compose(Pose(3.0, 0.0)))
    world.stage.place("b", start)
    driving = world.robot("a")[Driving].drive(Twist(0.1, 0.0, 0.0), source="test")
    await forward(seconds=0.1)
    assert "b is in the way" in (await say(desk, b'{"do": "reset", "robot": "a"}\n'))["error"]
    assert driving in world.robot("a").actions.running()  # a refusal stops nothing
