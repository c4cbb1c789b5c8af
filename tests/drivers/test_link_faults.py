"""Bad links of each driver: the robot stops in time, the state is true, nothing hangs, it comes back."""

import asyncio
import math
import shutil
from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from roboglot.autonomy import Autonomy
from roboglot.clients.slamware import SlamwareRefused
from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Unconnected
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import assert_pose
from roboglot.wire.slamware.chapters.motion import Direction, MoveByOptions
from tests.drivers.bad_link import (
    BACKS,
    SPEED,
    Connect,
    cut,
    drives,
    healed,
    refused,
    stands,
    succeeds,
    succeeds_slowly,
    until,
)
from tests.drivers.clients import Open, OpenRest
from tests.drivers.rig import Rig

pytestmark = pytest.mark.world("office")
DOG_LATER = [*BACKS[:2], pytest.param("cyberdog", marks=pytest.mark.slow)]
NOTICED = {"slamware": 1.2, "robomaster": 0.6, "cyberdog": 1.3}  # s until the link counts as lost


async def half_open(way: Rig) -> None:
    way.fault.silent = True


async def garbage(way: Rig) -> None:
    way.fault.garbage = b"\x00\xff\xfeno protocol of this world; \r\n\r\n"


async def restart(way: Rig) -> None:
    await way.stop()


async def started(way: Rig) -> None:
    await way.start()


async def other_certificates(way: Rig) -> None:
    await way.stop()
    way.lose_certificates()
    await way.start()


FAULTS: dict[str, tuple[Callable[[Rig], Awaitable[None]], Callable[[Rig], Awaitable[None]]]] = {
    "half-open": (half_open, healed),
    "cut": (cut, healed),
    "garbage": (garbage, healed),
    "restart": (restart, started),
}


QUICK = {("robomaster", "half-open")}  # for every run; the supervisor handles all faults alike
CELLS = [
    pytest.param(back, fault, marks=() if (back, fault) in QUICK else pytest.mark.slow)
    for back in BACKS
    for fault in FAULTS
]


@pytest.mark.parametrize(("back", "fault"), CELLS)
async def test_stops_in_time_reports_truthfully_and_comes_back(
    back: str, fault: str, way: Rig, connect: Connect, world: World, rest: OpenRest, text_door: Open
) -> None:
    async with connect() as driven:
        clock, link = driven.clock, driven[Link]
        dashboard, script = await rest(driven), await text_door(driven)
        action = await drives(driven, world)
        begin, end = FAULTS[fault]
        before = world.truth.pose_of("a")
        await begin(way)
        noticing = asyncio.ensure_future(until(clock, lambda: link.state is LinkState.LOST, 5))
        await clock.sleep(0.5)
        assert world.truth.pose_of("a").distance_to(before) < SPEED * 0.5 + 0.02
        await clock.sleep(0.3)  # for braking
        await stands(world, clock)
        assert await noticing <= NOTICED[back]
        assert link.reason
        assert link.age() > 0.1
        assert [each.name for each in driven[Health].faults] == ["link lost"]
        await until(clock, lambda: action.status.ended, 3)  # nothing hangs
        assert action.status is ActionStatus.ABORTED
        await refused(driven)
        # The doors in front are open, report it, and refuse to move the robot.
        health = await dashboard.get_robot_health()
        assert health.has_error
        assert (await dashboard.get_power_status()).battery_percentage > 0
        assert await script.ask("chassis speed x 0.3 y 0 z 0;") == "fail"
        await end(way)
        await until(clock, lambda: link.state is LinkState.UP)
        assert driven[Health].faults == []
        await stands(world, clock)  # nothing that was requested meanwhile is done late
        await succeeds(driven)


@pytest.mark.slow
@pytest.mark.parametrize("back", ["slamware", "cyberdog"])
async def test_another_robot_is_not_taken_for_this_one(
    back: str, way: Rig, robot: Robot, connect: Connect, caplog: pytest.LogCaptureFixture
) -> None:
    """Places of this one would be deleted as if it had, and its commands were for elsewhere."""
    async with connect() as driven:
        clock, link, own = driven.clock, driven[Link], robot.description
        await way.stop()
        await until(clock, lambda: link.state is LinkState.LOST, 5)
        robot.description = replace(own, serial="f" * 32)
        await way.start()
        await until(clock, lambda: "another robot answers" in link.reason, 20)
        assert link.state is LinkState.LOST
        assert f"cannot reach {link.address} yet: another robot answers now, " in caplog.text
        await refused(driven)
        await way.stop()
        robot.description = own
        await way.start()
        await until(clock, lambda: link.state is LinkState.UP)


@pytest.mark.slow
@pytest.mark.parametrize("back", ["cyberdog"])
async def test_new_certificates_are_used_at_once(back: str, way: Rig, connect: Connect, world: World) -> None:
    async with connect() as driven:
        clock, link = driven.clock, driven[Link]
        await drives(driven, world)
        await other_certificates(way)
        await until(clock, lambda: link.state is LinkState.LOST, 3)
        await clock.sleep(4)
        assert link.state is LinkState.LOST  # the old ones let no client in
        assert link.reason
        await stands(world, clock)
        way.hand_out_certificates()
        await until(clock, lambda: link.state is LinkState.UP)
        await succeeds(driven)


@pytest.mark.parametrize(
    ("back", "fault"),
    [
        ("robomaster", "loss"),
        *(  # the same relay between other ends
            pytest.param(*cell, marks=pytest.mark.slow)
            for cell in (
                *(("slamware", "delay"), ("slamware", "loss"), ("robomaster", "delay")),
                *(("cyberdog", "delay"), ("cyberdog", "loss")),
            )
        ),
    ],
)
async def test_a_bad_link_still_drives(back: str, fault: str, way: Rig, connect: Connect, world: World) -> None:
    async with connect() as driven:
        way.fault.delay = 0.05 if fault == "delay" else 0.0
        way.fault.lossy = fault == "loss"
        start = await succeeds_slowly(driven, world)
        assert world.truth.pose_of("a").relative_to(start).x == pytest.approx(0.2, abs=0.05)
        assert driven[Link].state is LinkState.UP
        action = await drives(driven, world)  # it stops when its client is gone
        action.cancel("its client is gone")
        await driven.clock.sleep(0.8)  # half a second, and braking
        await stands(world, driven.clock)
        assert action.status.ended


@pytest.mark.parametrize(
    "back", ["slamware", *(pytest.param(b, marks=pytest.mark.slow) for b in BACKS if b != "slamware")]
)
async def test_link_that_is_too_slow_counts_as_lost(back: str, way: Rig, connect: Connect, world: World) -> None:
    slow = 0.6  # s each way
    async with connect() as driven:
        action, clock, link = await drives(driven, world), driven.clock, driven[Link]
        way.fault.delay = slow
        assert await until(clock, lambda: link.state is not LinkState.UP, 5) <= NOTICED[back] + slow
        await clock.sleep(2 * slow + 0.3)  # late commands arrive, and it brakes
        await stands(world, clock)
        assert action.status is ActionStatus.ABORTED
        if link.state is not LinkState.UP:
            await refused(driven)
        await healed(way)
        await until(clock, lambda: link.state is LinkState.UP and link.age() < 0.3)
        await stands(world, clock)
        await succeeds(driven)


@pytest.mark.world("empty", body="robomaster_ep")
@pytest.mark.parametrize("delay", [pytest.param(0.05, marks=pytest.mark.slow), 0.1])
@pytest.mark.parametrize("back", ["robomaster"])
async def test_moves_of_late_ep_arrive_at_full_speed(
    back: str, delay: float, way: Rig, connect: Connect, world: World
) -> None:
    async with connect() as driven:
        way.fault.delay = delay
        await until(driven.clock, lambda: driven[Base].delay > 2 * delay)
        for offset in (Pose(0.2), Pose(0.3, 0.2, math.pi / 2)):
            start = world.truth.pose_of("a")
            action = driven[Driving].move_by(offset, source="test")
            await until(driven.clock, partial(lambda action: action.status.ended, action), 10)
            assert action.status is ActionStatus.SUCCEEDED, action.reason
            here = world.truth.pose_of("a").relative_to(start)
            # What a busy machine delivers a step (0.02 s) late is 0.02 m and 2.3 degrees at full speed.
            assert_pose(here, x=offset.x, y=offset.y, deg=math.degrees(offset.yaw), within=0.03, within_deg=4)


@pytest.mark.parametrize("back", DOG_LATER)
async def test_robot_away_at_the_start_is_connected_later(
    back: str, way: Rig, connect: Connect, rest: OpenRest, text_door: Open
) -> None:
    await cut(way)
    async with connect() as driven:
        assert driven[Link].state is LinkState.CONNECTING
        await refused(driven)
        dashboard, script = await rest(driven), await text_door(driven)
        for asked in (dashboard.get_power_status, dashboard.get_odo_pose, dashboard.get_current_speed):
            with pytest.raises(SlamwareRefused, match="is not connected"):  # no value is invented
                await asked()
        for question in ("robot battery", "chassis position", "chassis speed", "chassis attitude", "gimbal attitude"):
            assert await script.ask(f"{question} ?;") == "fail"
        assert await script.ask("chassis push attitude on;") == "fail"
        await driven.clock.sleep(2)
        await healed(way)
        await until(driven.clock, lambda: driven[Link].state is LinkState.UP)
        assert (await dashboard.get_power_status()).battery_percentage > 80
        assert int(await script.ask("robot battery ?;")) > 80
        assert (await dashboard.get_odo_pose()).x == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("back", ["robomaster"])
async def test_way_of_our_own_autonomy_ends_with_link(
    back: str, way: Rig, connect: Connect, robot: Robot, world: World
) -> None:
    """An EP's wheels and odometry through the driver, and a lidar beside it: navigation is ours."""
    async with connect() as driven:
        clock = driven.clock
        pilot = Robot("pilot", robot.description, clock)
        for interface in (Base, Odometry):
            pilot.add(interface, driven[interface])
        pilot.add(Lidar, robot[Lidar])

        def see(taken: ScanTaken) -> None:
            pilot.events.publish(replace(taken, odometry=driven[Odometry].reading.pose))

        forget = robot.events.listen(ScanTaken, see)
        autonomy = Autonomy(pilot)
        await autonomy.start(wait=True)
        await clock.sleep(1.5)
        start = world.truth.pose_of("a")
        action = pilot[Navigation].navigate_to([Point(3.0, 0.0)], NavigationOptions(), source="test")
        await until(clock, lambda: world.truth.pose_of("a").distance_to(start) > 0.3)
        await cut(way)
        lost = world.truth.pose_of("a")
        await until(clock, lambda: action.status.ended, 2)
        assert action.status is ActionStatus.ABORTED
        assert isinstance(action.error, Unconnected)
        await clock.sleep(0.5)
        assert world.truth.pose_of("a").distance_to(lost) < 0.4
        await healed(way)
        await until(clock, lambda: driven[Link].state is LinkState.UP)
        await stands(world, clock)
        forget()
        await autonomy.close()


@pytest.mark.parametrize("back", DOG_LATER)
async def test_releasing_a_silent_robot_ends_while_time_stands(
    back: str, way: Rig, connect: Connect, world: World
) -> None:
    async with connect() as driven:
        driven[Driving].drive(Twist(x=SPEED), source="test")
        start = world.truth.pose_of("a")
        await until(driven.clock, lambda: world.truth.pose_of("a").distance_to(start) > 0.1, 5)
        way.fault.silent = True
    # The fixtures close the rest while the clock stands still: it must not hang.


@pytest.mark.slow
@pytest.mark.parametrize("back", ["robomaster"])
async def test_blocked_pushes_name_port_and_are_tried_seldom(
    back: str, way: Rig, connect: Connect, caplog: pytest.LogCaptureFixture
) -> None:
    way.fault.deaf = True
    async with connect() as driven:
        await driven.clock.sleep(25)
        assert caplog.text.count("connected to ") <= 6
        port = way.url.partition("push=")[2].partition("&")[0]
        assert f"none of the robot's pushes arrive: let UDP port {port} of this machine be reached" in caplog.text
        way.fault.deaf = False
        await until(driven.clock, lambda: driven[Link].state is LinkState.UP and driven[Link].age("position") < 0.1)


@pytest.mark.slow
@pytest.mark.parametrize("back", ["cyberdog"])
async def test_dogs_reckoned_pose_stands_when_its_frames_do(
    back: str, way: Rig, connect: Connect, world: World
) -> None:
    async with connect() as driven:
        await drives(driven, world)
        reported, real = driven[Odometry].reading.pose, world.truth.pose_of("a")
        way.fault.silent = True
        await driven.clock.sleep(2)
        way_reported = reported.distance_to(driven[Odometry].reading.pose)
        assert way_reported == pytest.approx(real.distance_to(world.truth.pose_of("a")), abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("back", ["cyberdog"])
async def test_errors_for_clients_name_no_files(
    back: str, way: Rig, connect: Connect, rest: OpenRest, tmp_path: Path
) -> None:
    async with connect() as driven:
        dashboard = await rest(driven)
        shutil.rmtree(tmp_path / "driver")
        await cut(way)
        await until(driven.clock, lambda: driven[Link].state is LinkState.LOST, 5)
        await driven.clock.sleep(3)
        health = await dashboard.get_robot_health()
        with pytest.raises(SlamwareRefused) as refused_:
            await dashboard.begin("MoveByAction", MoveByOptions(Direction.FORWARD, duration=500))
        for reported in (driven[Link].reason, str(health), str(refused_.value), str(driven[Health].faults)):
            assert str(tmp_path) not in reported
            assert "certs" not in reported
