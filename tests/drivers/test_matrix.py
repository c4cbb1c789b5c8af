"""Each door in front of each driver, whose robot is a simulated one behind the driver's own vendor's door."""

import asyncio
import math
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose
from roboglot.testing.addresses import free_port
from tests.drivers.clients import Drive, served
from tests.drivers.fronts import Front, front
from tests.drivers.rig import time_passes

QUICK = {("robomaster", "slamware")}  # for every run; a text door before a dog: cyberdog/test_driver.py
CELLS = [
    pytest.param(back, door, marks=() if (back, door) in QUICK else pytest.mark.slow)
    for back in ("slamware", "robomaster", "cyberdog")
    for door in ("slamware", "robomaster", "cyberdog", "visual")
    if back != door or back == "cyberdog"
]


TELLS_NO_POSE = {("robomaster", "cyberdog")}  # the dog's app gets a map pose, and an EP has neither map nor pose
# RoboMaster's text has no goals, and an EP has neither navigation nor a lidar for ours.
NAVIGATES = {
    ("slamware", "cyberdog"),
    ("slamware", "visual"),
    ("cyberdog", "cyberdog"),
    ("cyberdog", "slamware"),
    ("cyberdog", "visual"),
}
LEFT = 0.5  # m


async def agree(client: Front, reported_start: Pose, real: Pose) -> None:
    """Assert that the client's pose agrees with the true one, to 5 cm and 2 degrees."""
    reported = await client.pose()
    assert reported
    reported = reported.relative_to(reported_start)
    assert_pose(reported, x=real.x, y=real.y, deg=math.degrees(real.yaw), within=0.05, within_deg=2)


@pytest.fixture
async def url(back: str, robot: Robot, tmp_path: Path) -> AsyncIterator[str]:
    """The simulated robot behind the vendor's door."""
    async with served(back, robot, tmp_path) as at:
        yield at


@pytest.fixture
async def passing(forward: Forward, back: str, door: str) -> AsyncIterator[None]:
    """Robot time passes by itself."""
    async with time_passes(forward, threads="cyberdog" in {back, door}):
        yield


@pytest.mark.world("office")
@pytest.mark.parametrize(("back", "door"), CELLS)
async def test_a_cell(
    back: str, door: str, url: str, drive: Drive, robot: Robot, world: World, passing: None, tmp_path: Path
) -> None:
    await robot.clock.sleep(2)
    driven = await drive(url)
    assert driven[Link].state is LinkState.UP
    await robot.clock.sleep(3.0 if back == "cyberdog" else 0.5)  # meanwhile a dog localizes itself in its map
    async with front(door, driven, tmp_path / "front", free_port) as client:
        assert await client.battery() == pytest.approx(robot[Battery].state.percentage * 100, abs=1)
        reported_start, start = await client.pose(), world.truth.pose_of("a")
        assert (reported_start is None) is ((back, door) in TELLS_NO_POSE)
        for _ in range(3):  # an open square: start and end differ, and so do left and right
            await client.side()
            await client.turn()
        await robot.clock.sleep(1)
        real = world.truth.pose_of("a").relative_to(start)
        assert_pose(real, x=0.0, y=0.4, deg=-90, within=0.2, within_deg=25)  # some clients only report times
        if reported_start is not None:
            await agree(client, reported_start, real)
        if (back, door) in NAVIGATES:
            assert reported_start
            before = world.truth.pose_of("a")
            await client.navigate(LEFT)
            await robot.clock.sleep(1)
            assert_pose(world.truth.pose_of("a").relative_to(before), x=0.0, y=LEFT, within=0.2)
            await agree(client, reported_start, world.truth.pose_of("a").relative_to(start))
        begun = world.truth.pose_of("a")
        await client.go()
        async with asyncio.timeout(60):
            while world.truth.pose_of("a").distance_to(begun) < 0.1:
                await robot.clock.sleep(0.05)
        await client.hang_up()
        await robot.clock.sleep(1.5)
        before = world.truth.pose_of("a")
        await robot.clock.sleep(0.5)
        assert world.truth.pose_of("a").distance_to(before) < 0.02
        assert driven.actions.running() == []
