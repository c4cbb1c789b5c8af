"""What a bad link does to the Slamware driver: the robot stops in time, the state tells the truth, it comes back."""

import asyncio
from collections.abc import AsyncIterator

import pytest
from chain import Drive
from link_proxy import Proxy

from roboglot.config import SlamwareConfig
from roboglot.model.actions import ActionStatus
from roboglot.model.components.driving import Driving
from roboglot.model.components.health import Health
from roboglot.model.components.link import Link, LinkState
from roboglot.model.components.localization import Localization
from roboglot.model.components.navigation import Navigation, NavigationOptions
from roboglot.model.errors import Unconnected
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world import World
from roboglot.testing import Forward


@pytest.fixture
async def proxy(slamware_door: SlamwareDoor, robot: Robot) -> AsyncIterator[Proxy]:
    made = Proxy(robot.clock, ("127.0.0.1", slamware_door.port))
    made.port = await made.start()  # type: ignore[attr-defined]
    yield made
    await made.close()


@pytest.fixture
async def driven(proxy: Proxy, drive: Drive, forward: Forward) -> Robot:
    await forward(seconds=2)
    robot = await drive(f"slamware://127.0.0.1:{proxy.port}")  # type: ignore[attr-defined]
    assert robot[Link].state is LinkState.UP
    return robot


async def driving(robot: Robot, forward: Forward) -> None:
    robot[Driving].drive(Twist(x=0.3), source="test")
    await forward(seconds=2)


async def stands(world: World, forward: Forward) -> bool:
    """Whether the robot moves less than a centimetre within half a second."""
    before = world.pose_of("a")
    await forward(seconds=0.5)
    return world.pose_of("a").distance_to(before) < 0.01


@pytest.mark.parametrize("fault", ["silent", "cut", "garbage"])
async def test_the_robot_stops_in_half_a_second_and_the_state_tells_the_truth(
    driven: Robot, proxy: Proxy, world: World, forward: Forward, fault: str
) -> None:
    await driving(driven, forward)
    if fault == "silent":
        proxy.silent = True
    elif fault == "cut":
        proxy.refusing = True
        proxy.cut()
    else:
        proxy.garbage = b"\x00\xffHTTP nonsense\r\n\r\n"
    before = world.pose_of("a")
    await forward(seconds=0.5)
    assert world.pose_of("a").distance_to(before) < 0.3 * 0.5 + 0.01
    await forward(seconds=0.5)  # braking
    assert await stands(world, forward)
    link = driven[Link]
    assert link.state is LinkState.LOST
    assert link.reason
    assert [fault.name for fault in driven[Health].faults] == ["link lost"]
    assert link.age() > 0.8
    await forward(seconds=3)
    assert driven.actions.running() == []
    assert driven.actions.history[-1].status is ActionStatus.ABORTED
    with pytest.raises(Unconnected):
        driven[Driving].move_by(Pose(x=1.0), source="test")
    assert await stands(world, forward)
    # It recovers by itself, and nothing that was asked for meanwhile is done late.
    proxy.silent = proxy.refusing = False
    proxy.garbage = b""
    proxy.cut()
    await forward(seconds=11)
    assert link.state is LinkState.UP
    assert driven[Health].faults == []
    assert await stands(world, forward)
    await driving(driven, forward)
    assert not await stands(world, forward)


async def test_a_slow_link_still_drives(driven: Robot, proxy: Proxy, world: World, forward: Forward) -> None:
    proxy.delay = 0.1
    start = world.pose_of("a")
    action = driven[Driving].move_by(Pose(x=0.5), source="test")
    await forward(seconds=15)
    assert action.status is ActionStatus.SUCCEEDED
    assert world.pose_of("a").relative_to(start).x == pytest.approx(0.5, abs=0.05)
    assert driven[Link].state is LinkState.UP


async def test_a_robot_that_restarts_is_found_again(
    driven: Robot, robot: Robot, slamware_door: SlamwareDoor, world: World, forward: Forward
) -> None:
    await driving(driven, forward)
    await slamware_door.close()
    await forward(seconds=2)
    assert driven[Link].state is LinkState.LOST
    assert await stands(world, forward)
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=slamware_door.port))
    await door.start()
    await forward(seconds=11)
    assert driven[Link].state is LinkState.UP
    action = driven[Driving].move_by(Pose(x=0.3), source="test")
    await forward(seconds=6)
    assert action.status is ActionStatus.SUCCEEDED
    await door.close()


async def test_what_the_robot_still_does_when_the_link_is_back_is_stopped(
    driven: Robot, proxy: Proxy, world: World, forward: Forward
) -> None:
    action = driven[Navigation].navigate_to([Point(6.0, 0.0)], NavigationOptions(), source="test")
    await forward(seconds=2)
    proxy.refusing = True
    proxy.cut()
    await forward(seconds=1.5)
    assert action.status is ActionStatus.ABORTED  # its client was told; the robot drives on by itself
    proxy.refusing = False
    await forward(seconds=3)
    assert driven[Link].state is LinkState.UP
    assert await stands(world, forward)


async def test_a_robot_that_is_away_at_the_start_is_connected_later(
    drive: Drive, robot: Robot, slamware_door: SlamwareDoor, proxy: Proxy, forward: Forward
) -> None:
    proxy.refusing = True
    driven = await drive(f"slamware://127.0.0.1:{proxy.port}")  # type: ignore[attr-defined]
    assert driven[Link].state is LinkState.CONNECTING
    assert driven[Localization].pose == Pose()
    with pytest.raises(Unconnected, match="not connected"):
        driven[Driving].move_by(Pose(x=1.0), source="test")
    await forward(seconds=4)
    proxy.refusing = False
    await forward(seconds=11)
    assert driven[Link].state is LinkState.UP
    assert driven.description.model == robot.description.model
    await asyncio.sleep(0)
