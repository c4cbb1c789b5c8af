"""Poses of robots that others surround: hulls known by radio contradict no pose, unknown things and wrong poses do."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
import pytest_asyncio

from roboglot.config import RobotConfig, StartConfig
from roboglot.model.clock import LockstepClock
from roboglot.model.components.logistics.traffic_radio import Announcement, TrafficRadio
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.events import LocalizationLost, PoseConfirmed
from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.simulation.components.logistics.traffic_radio import SimulatedTrafficRadio
from tests.meeting import WORLDS, opened, survey

TIGHT = WORLDS[1]
HALL, ELSEWHERE = Pose(15.0, 6.0), Pose(10.0, 3.6, 2.0)
AROUND, OTHERS, RADIUS = 0.75, 6, 0.25  # m, robots, m: they hide most of the hall
SECONDS = 6.0  # s: long enough to lose a pose


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def building() -> OccupancyGrid:
    return await survey(TIGHT)


def ring() -> list[Pose]:
    angles = (math.tau * number / OTHERS for number in range(OTHERS))
    return [Pose(HALL.x + AROUND * math.cos(angle), HALL.y + AROUND * math.sin(angle)) for angle in angles]


def announce_from(robot: Robot, poses: Sequence[Pose], clock: LockstepClock, patch: pytest.MonkeyPatch) -> None:
    """Let the robot hear others that stand at ``poses`` (map)."""
    radio = robot[TrafficRadio]
    assert isinstance(radio, SimulatedTrafficRadio)
    assert radio.announced is not None
    frame = radio.announced.frame

    def heard() -> list[Announcement]:
        return [Announcement(f"b{n}", frame, clock.time(), pose, 0.0, RADIUS) for n, pose in enumerate(poses)]

    patch.setattr(radio, "heard", heard)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("announced", "carried", "lost"),
    [
        pytest.param(True, False, False, id="known others"),
        pytest.param(False, False, True, id="unknown things"),
        pytest.param(True, True, True, id="carried away"),
    ],
)
@pytest.mark.asyncio(loop_scope="module")
async def test_only_what_is_unknown_contradicts_a_pose(
    building: OccupancyGrid, announced: bool, carried: bool, lost: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = StartConfig(HALL.x, HALL.y, HALL.yaw)
    async with opened(TIGHT, [RobotConfig("a", start=start)], 1) as (fleet, clock):
        robot, stage = fleet.robots["a"], fleet.world.stage
        confirmed, losses = robot.events.subscribe(PoseConfirmed), robot.events.subscribe(LocalizationLost)
        robot[Mapping].load(building, HALL)
        await clock.advance(2.0)
        assert confirmed.drain()
        for pose in ring():
            stage.add_obstacle(pose, (1.6 * RADIUS, 1.6 * RADIUS, 1.0))
        if announced:
            announce_from(robot, ring(), clock, monkeypatch)
        if carried:
            stage.place("a", ELSEWHERE)
        await clock.advance(SECONDS)
        assert bool(losses.drain()) is lost
        if not carried:
            assert robot[Localization].pose.distance_to(HALL) < 0.02


@pytest.mark.slow
@pytest.mark.asyncio(loop_scope="module")
async def test_map_loaded_in_a_crowd_is_confirmed(building: OccupancyGrid, monkeypatch: pytest.MonkeyPatch) -> None:
    """Announcements count while the robot itself is in doubt, and says nothing."""
    start = StartConfig(HALL.x, HALL.y, HALL.yaw)
    async with opened(TIGHT, [RobotConfig("a", start=start)], 1) as (fleet, clock):
        robot = fleet.robots["a"]
        robot[Mapping].load(building, HALL)
        await clock.advance(2.0)
        announce_from(robot, ring(), clock, monkeypatch)
        for pose in ring():
            fleet.world.stage.add_obstacle(pose, (1.6 * RADIUS, 1.6 * RADIUS, 1.0))
        confirmed, losses = robot.events.subscribe(PoseConfirmed), robot.events.subscribe(LocalizationLost)
        robot[Mapping].load(building, HALL)
        await clock.advance(SECONDS)
        assert confirmed.drain()
        assert not losses.drain()
        assert robot[Localization].quality > 0.5
