"""A simulated robot behind its REST door, a driver connected to it, and another vendor's door in front."""

import asyncio
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.config import RobotConfig
from roboglot.drivers.slamware.capabilities import APPROXIMATIONS
from roboglot.drivers.slamware.chapters.motion.base import SlamwareBase
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Busy, Refused, Unreachable
from roboglot.model.events import LinkChanged
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.model.sensing import LaserScan
from roboglot.protocols.slamware.chapters.motion.speed_limits import SpeedLimits
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world import World
from roboglot.storage.database import Database
from roboglot.testing import Forward, assert_pose
from roboglot.wire.slamware.chapters.motion import AngleOptions
from tests.drivers.clients import Open, OpenRest, Script, Until
from tests.narrowing import of_kind


def points_of(scan: LaserScan) -> np.ndarray:
    """Points in base_link, m, (n, 2)."""
    seen = np.isfinite(scan.ranges)
    angles, ranges = scan.angles[seen] + scan.mount.yaw, scan.ranges[seen]
    return np.stack([scan.mount.x + ranges * np.cos(angles), scan.mount.y + ranges * np.sin(angles)], axis=1)


def distances_between(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Distance from each point to the nearest of the others."""
    return np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1)


@pytest.mark.slow  # long; test_matrix.py drives one by this driver
async def test_a_robomaster_script_drives_an_asymmetric_path(
    driven: Robot, text_door: Open, world: World, forward: Forward
) -> None:
    client = await text_door(driven)
    script, start = Script(client, forward), world.truth.pose_of("a")
    # Ahead 0.8 m, a right turn (positive in the text protocol), ahead 0.4 m, 0.3 m to the right, back 0.2 m.
    for move in ("x 0.8", "z 90", "x 0.4", "y 0.3", "x -0.2"):
        assert await script.done(f"chassis move {move} wait_for_complete true;") == "ok"
    assert_pose(world.truth.pose_of("a").relative_to(start), x=0.5, y=-0.2, deg=-90)
    position = await client.numbers("chassis position ?;")
    here = driven[Odometry].reading.pose
    assert position[0] == pytest.approx(here.x, abs=0.02)
    assert position[1] == pytest.approx(-here.y, abs=0.02)


@pytest.mark.slow  # long; test_matrix.py drives a way by this driver
async def test_a_square_ends_where_it_began(driven: Robot, text_door: Open, world: World, forward: Forward) -> None:
    script, start = Script(await text_door(driven), forward), world.truth.pose_of("a")
    for _ in range(4):
        assert await script.done("chassis move x 0.25 wait_for_complete true;") == "ok"
        assert await script.done("chassis move z -90 wait_for_complete true;") == "ok"
    assert_pose(world.truth.pose_of("a").relative_to(start), x=0.0, y=0.0, deg=0.0)
    assert_pose(driven[Localization].pose, x=0.0, y=0.0, deg=0.0)


async def test_battery_and_speed_are_the_robots(driven: Robot, robot: Robot, text_door: Open, forward: Forward) -> None:
    client = await text_door(driven)
    assert await client.numbers("robot battery ?;") == [round(robot[Battery].state.percentage * 100)]
    assert await client.ask("chassis speed x 0.3 z 0;") == "ok"
    await forward(seconds=1.5)
    assert (await client.numbers("chassis speed ?;"))[0] == pytest.approx(0.3, abs=0.03)
    assert await client.ask("gimbal moveto p 10;") == "fail"  # this driver has none
    assert Gimbal not in driven


async def test_a_script_that_hangs_up_stops_the_robot(
    driven: Robot, text_door: Open, world: World, forward: Forward
) -> None:
    client = await text_door(driven)
    assert await client.ask("chassis speed x 0.4;") == "ok"
    await forward(seconds=2)
    client.writer.transport.abort()
    await asyncio.sleep(0.02)
    await forward(seconds=0.5)
    start = world.truth.pose_of("a")
    await forward(seconds=1)
    assert world.truth.pose_of("a").distance_to(start) < 0.06  # braking from 0.4 m/s
    await forward(seconds=1)
    assert driven.actions.running() == []


@pytest.mark.slow
async def test_arc_is_driven_in_turns_with_its_mean(driven: Robot, world: World, forward: Forward) -> None:
    start = world.truth.pose_of("a")
    action = driven[Driving].drive(Twist(x=0.2, yaw=0.3), source="test")
    await forward(seconds=4)
    yaw = world.truth.pose_of("a").relative_to(start).yaw
    assert yaw == pytest.approx(1.2, abs=0.25)
    moved = world.truth.pose_of("a").distance_to(start)
    assert moved == pytest.approx(2 * 0.2 / 0.3 * math.sin(0.6), abs=0.12)
    action.cancel()
    await forward(seconds=2)
    assert action.status is ActionStatus.CANCELED


async def test_the_robots_speed_limit_is_put_back(driven: Robot, slamware_door: SlamwareDoor, forward: Forward) -> None:
    async with SlamwareClient("127.0.0.1", slamware_door.port, clock=driven.clock) as other:
        before = await other.get_system_parameter("base.max_moving_speed")
        action = driven[Driving].drive(Twist(x=0.1), source="test")
        await forward(seconds=1)
        assert float(await other.get_system_parameter("base.max_moving_speed")) == pytest.approx(0.1)
        action.cancel()
        await forward(seconds=2)
        assert await other.get_system_parameter("base.max_moving_speed") == before


@pytest.mark.slow
async def test_lower_limit_of_client_holds_for_robot(driven: Robot, robot: Robot, forward: Forward) -> None:
    base = driven[Base]
    assert robot[Base].limits.twist.x > 0.5
    base.limits = replace(base.limits, twist=Twist(0.2, 0.0, 1.0))
    action = driven[Driving].drive(Twist(x=0.5), source="test")
    await forward(seconds=2)
    assert robot[Base].velocity.x == pytest.approx(0.2, abs=0.03)
    action.cancel()
    await forward(seconds=2)
    going = driven[Navigation].navigate_to([Point(3.0, 0.0)], NavigationOptions(), source="test")
    speeds = []
    for _ in range(12):
        await forward(seconds=0.5)
        speeds.append(robot[Base].velocity.x)
    assert 0.05 < max(speeds) < 0.22  # it drives to goals at a share of its limit
    limits = SpeedLimits(driven)
    with pytest.raises(Refused, match="keeps the speed that it began with"):
        limits.set(speed=0.1)
    going.cancel()
    await forward(seconds=2)
    limits.set(speed=0.1)


async def test_limit_of_killed_program_is_restored_next_time(
    slamware_door: SlamwareDoor, clock: LockstepClock, forward: Forward, tmp_path: Path
) -> None:
    url, database = f"slamware://127.0.0.1:{slamware_door.port}", Database(tmp_path / "kept.db")

    async def run() -> Fleet:
        fleet = build_fleet("empty", [RobotConfig("b", url)], clock=clock, seed=1, database=database)
        await fleet.start(wait=True)
        return fleet

    async with SlamwareClient("127.0.0.1", slamware_door.port, clock=clock) as other:
        await forward(seconds=2)
        before = await other.get_system_parameter("base.max_moving_speed")
        first = await run()
        first.robots["b"][Driving].drive(Twist(x=0.1), source="test")
        await forward(seconds=1)
        dead = SlamwareClient("127.0.0.1", 9, clock=clock)  # a killed program sends nothing more
        base = first.robots["b"][Base]
        assert isinstance(base, SlamwareBase)
        base._limit_restore._client = dead
        await first.close()
        dead.close()
        assert float(await other.get_system_parameter("base.max_moving_speed")) == pytest.approx(0.1)
        second = await run()
        assert await other.get_system_parameter("base.max_moving_speed") == before
        assert second.robots["b"][Base].limits.twist.x == pytest.approx(float(before))
        await second.close()
    database.close()


async def test_it_navigates_by_the_robots_own_skill(driven: Robot, world: World, forward: Forward) -> None:
    start = world.truth.pose_of("a")
    action = driven[Navigation].navigate_to([Point(1.0, 0.5)], NavigationOptions(yaw=-1.0), source="test")
    await forward(seconds=1)
    assert of_kind(action.feedback, NavigationFeedback).stage == "driving"
    assert of_kind(action.feedback, NavigationFeedback).remaining.length > 0.3
    await forward(seconds=15)
    assert action.status is ActionStatus.SUCCEEDED
    assert_pose(world.truth.pose_of("a").relative_to(start), x=1.0, y=0.5, deg=math.degrees(-1.0))


@pytest.mark.slow  # in short: test_it_navigates_by_the_robots_own_skill
async def test_navigation_fails_in_model_words_stops_when_cancelled(
    driven: Robot, world: World, forward: Forward
) -> None:
    action = driven[Navigation].navigate_to([Point(500.0, 500.0)], NavigationOptions(), source="test")
    await forward(seconds=5)
    assert isinstance(action.error, Unreachable)
    action = driven[Navigation].navigate_to([Point(3.0, 0.0)], NavigationOptions(), source="test")
    await forward(seconds=3)
    action.cancel()
    await forward(seconds=2)
    assert action.status is ActionStatus.CANCELED
    before = world.truth.pose_of("a")
    await forward(seconds=2)
    assert world.truth.pose_of("a").distance_to(before) < 0.01


async def test_a_refused_limit_ends_the_drive(
    driven: Robot, world: World, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The robot drove at its own speed instead, several times as fast."""

    async def refuse(*_: object) -> None:
        raise SlamwareRefused("PUT parameter", 400, "Invalid parameter")

    monkeypatch.setattr(SlamwareClient, "set_system_parameter", refuse)
    before = world.truth.pose_of("a")
    action = driven[Driving].drive(Twist(0.1), lifetime=60.0, source="test")
    await forward(seconds=2)
    assert action.status is ActionStatus.ABORTED
    assert "Invalid parameter" in action.reason
    assert world.truth.pose_of("a").distance_to(before) < 0.01


async def test_a_paused_joystick_stands(driven: Robot, world: World, forward: Forward) -> None:
    """It drove on, reported as paused, and its next frame was obeyed, too."""
    driving = driven[Driving]
    action = driving.drive(Twist(0.3), lifetime=60.0, source="test")
    await forward(seconds=2)
    action.pause()
    await forward(seconds=2)
    before = world.truth.pose_of("a")
    assert driving.drive(Twist(0.2), lifetime=60.0, source="test") is action
    await forward(seconds=2)
    assert world.truth.pose_of("a").distance_to(before) < 0.01
    action.resume()
    await forward(seconds=2)
    assert world.truth.pose_of("a").distance_to(before) > 0.1


@pytest.mark.slow  # in short: test_it_navigates_by_the_robots_own_skill
async def test_a_paused_way_goes_on(driven: Robot, world: World, forward: Forward) -> None:
    action = driven[Navigation].navigate_to([Point(1.5, 0.0)], NavigationOptions(), source="test")
    await forward(seconds=2)
    action.pause()
    await forward(seconds=2)
    before = world.truth.pose_of("a")
    await forward(seconds=2)
    assert world.truth.pose_of("a").distance_to(before) < 0.01
    assert action.status is ActionStatus.EXECUTING
    action.resume()
    await forward(seconds=15)
    assert action.status is ActionStatus.SUCCEEDED


async def test_readings_are_in_the_models_units(driven: Robot, robot: Robot, forward: Forward) -> None:
    await forward(seconds=3)
    scan, real = driven[Lidar].scan, robot[Lidar].scan
    assert scan is not None
    assert real is not None
    for one, other in ((scan, real), (real, scan)):
        assert np.quantile(distances_between(points_of(one), points_of(other)), 0.95) < 0.05
    assert len(np.unique(points_of(scan).round(2), axis=0)) > 200  # asymmetric enough to tell left from right
    np.testing.assert_array_equal(driven[Mapping].grid.log_odds.shape, robot[Mapping].grid.log_odds.shape)
    assert driven[Imu].reading.linear_acceleration.z == pytest.approx(9.8, abs=0.5)
    assert driven[DockContact].docked == robot[DockContact].docked
    assert driven[Docking].home == robot[Docking].home
    assert driven[Link].age() <= 0.1
    assert driven[Link].age("battery") <= 1.0


@pytest.mark.slow
async def test_lease_names_the_client_that_moves_it(
    driven: Robot, slamware_door: SlamwareDoor, forward: Forward
) -> None:
    async with SlamwareClient("127.0.0.1", slamware_door.port, clock=driven.clock) as other:
        ours = driven[Navigation].navigate_to([Point(3.0, 0.0)], NavigationOptions(), source="test")
        await forward(seconds=1.5)
        assert driven[Link].holder == "us"
        await other.begin("RotateAction", AngleOptions(6.0))
        await forward(seconds=1)
        assert driven[Link].holder == "another client"
        assert ours.status is ActionStatus.ABORTED
        assert isinstance(ours.error, Busy)
        with pytest.raises(Busy, match="another client"):
            driven[Driving].move_by(Pose(x=0.2), source="test")
        with pytest.raises(Busy, match="another client"):
            driven[Localization].relocalize(source="test")  # would end the other driver's action
        taking = asyncio.ensure_future(driven[Lease].take("test"))
        while not taking.done():
            await forward(seconds=0.02)
        with driven.events.subscribe(LinkChanged) as reported:
            await forward(seconds=1)  # it brakes, and is not mistaken for the other's
            assert "another client" not in {event.holder for event in reported.drain()}
        await driven[Lease].release()
        mine = driven[Driving].move_by(Pose(x=0.2), source="test")
        await forward(seconds=1)
        assert driven[Link].holder == "us"
        await forward(seconds=5)
        assert mine.status is ActionStatus.SUCCEEDED


async def test_unsupported_motions_are_refused(driven: Robot) -> None:
    with pytest.raises(Refused, match="one by one"):
        driven[Driving].drive(WheelSpeeds(1, 1, 1, 1), source="test")
    with pytest.raises(Refused, match="present place"):
        await driven[Navigation].plan(Point(5, 5), Point(0, 0))


async def test_it_announces_what_it_adds(driven: Robot) -> None:
    kept_here = {Lease, Places, MapAnnotations, MapMemory, MapLibrary, FileStore, Settings, Ledger, Members}
    assert set(driven.interfaces) - kept_here == APPROXIMATIONS.keys()


@pytest.mark.world("empty", body="robomaster_ep")
async def test_robot_without_lidar_and_map_has_none_here(driven: Robot, rest: OpenRest) -> None:
    dashboard = await rest(driven)
    for ask in (dashboard.get_pose, dashboard.get_laser_scan, dashboard.get_known_area):
        with pytest.raises(SlamwareRefused) as refused:
            await ask()
        assert refused.value.code == 501
    assert not {Localization, Navigation, Docking, Lidar, Mapping} & set(driven.interfaces)
    assert (await dashboard.get_odo_pose()).x == pytest.approx(0.0, abs=0.01)
    assert (await dashboard.get_power_status()).battery_percentage > 50


async def test_command_while_braking_ends_at_its_time(
    driven: Robot, robot: Robot, forward: Forward, until: Until
) -> None:
    first = driven[Driving].drive(Twist(yaw=0.5), lifetime=0.3, source="test")
    await forward(seconds=0.4)
    assert not first.status.ended
    second = driven[Driving].drive(Twist(yaw=0.5), lifetime=0.3, source="test")
    await until(lambda: second.status.ended)
    await forward(seconds=1)
    assert abs(robot[Base].velocity.yaw) < 0.02
