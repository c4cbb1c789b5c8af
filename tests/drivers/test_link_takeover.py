"""Takeover of a robot whose link is back, or by someone else: our motion ends, theirs goes on."""

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.client_context import acting_for
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.lease import OUTSIDE, Lease
from roboglot.model.components.system.link import (
    OTHERS,
    US,
    Link,
    LinkState,
)
from roboglot.model.errors import Busy
from roboglot.model.events import LinkChanged
from roboglot.model.geometry import Point, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.wire.slamware.chapters.motion import AngleOptions
from tests.drivers.bad_link import SPEED, Connect, cut, drives, healed, stands, succeeds, until
from tests.drivers.clients import Open, OpenRest
from tests.drivers.rig import Rig

pytestmark = pytest.mark.world("office")


@pytest.mark.slow  # in short: test_task_begun_with_lost_answer_is_stopped_too
@pytest.mark.parametrize("back", ["slamware"])
async def test_task_still_running_at_reconnection_is_stopped(
    back: str, way: Rig, connect: Connect, world: World
) -> None:
    async with connect() as driven:
        here = driven[Localization].pose
        action = driven[Navigation].navigate_to([Point(here.x + 4.0, here.y)], NavigationOptions(), source="test")
        start = world.truth.pose_of("a")
        await until(driven.clock, lambda: world.truth.pose_of("a").distance_to(start) > 0.2)
        await until(driven.clock, lambda: driven[Link].holder == US, 1)
        await cut(way)
        await until(driven.clock, lambda: action.status is ActionStatus.ABORTED, 3)  # its client was notified
        lost = world.truth.pose_of("a")
        await driven.clock.sleep(0.5)
        assert world.truth.pose_of("a").distance_to(lost) > 0.05  # the robot goes on with its own action
        reported = driven.events.subscribe(LinkChanged)
        await healed(way)
        await until(driven.clock, lambda: driven[Link].state is LinkState.UP)
        await driven.clock.sleep(1)
        assert OTHERS not in {event.holder for event in reported.drain()}  # ours while it brakes
        reported.close()
        assert world.truth.pose_of("a").distance_to(start) < 3.5  # under way
        await stands(world, driven.clock)


@pytest.mark.parametrize("back", ["slamware"])
async def test_own_action_is_not_taken_for_anothers(back: str, way: Rig, connect: Connect, world: World) -> None:
    async with connect() as driven:
        way.fault.late = b"MoveByAction", 0.4  # the robot reports its number before this answer makes it ours
        with driven.events.subscribe(LinkChanged) as reported:
            action = driven[Driving].drive(Twist(x=0.2), source="test")
            await driven.clock.sleep(3)
            assert OTHERS not in {event.holder for event in reported.drain()}
        assert action.status is ActionStatus.EXECUTING


@pytest.mark.parametrize("back", ["slamware"])
async def test_task_begun_with_lost_answer_is_stopped_too(back: str, way: Rig, connect: Connect, world: World) -> None:
    async with connect() as driven:
        here, start = driven[Localization].pose, world.truth.pose_of("a")
        way.fault.after = b"MoveToAction"
        action = driven[Navigation].navigate_to([Point(here.x + 4.0, here.y)], NavigationOptions(), source="test")
        await until(driven.clock, lambda: action.status is ActionStatus.ABORTED, 3)
        await until(driven.clock, lambda: world.truth.pose_of("a").distance_to(start) > 0.2)  # it has begun
        await healed(way)
        await until(driven.clock, lambda: driven[Link].state is LinkState.UP)
        await driven.clock.sleep(1)
        await stands(world, driven.clock)
        assert driven[Link].holder == ""
        await succeeds(driven)


@pytest.mark.slow
@pytest.mark.parametrize("back", ["slamware"])
async def test_another_client_takes_over_from_a_manual_driver(
    back: str, way: Rig, connect: Connect, robot: Robot, rest: OpenRest, text_door: Open, world: World
) -> None:
    async with connect() as driven:
        action = await drives(driven, world)
        assert driven[Link].holder == US
        other = await rest(robot)
        theirs = await other.begin("RotateAction", AngleOptions(math.pi))
        await until(driven.clock, lambda: action.status.ended, 1)
        assert isinstance(action.error, Busy)
        await until(driven.clock, lambda: driven[Link].holder == OTHERS, 1)
        script = await text_door(driven)
        assert await script.ask("chassis speed x 0.3 y 0 z 0;") == "fail"
        assert await script.ask("chassis move x 0.3;") == "fail"
        assert [each.name for each in driven[Health].faults] == [OUTSIDE]
        await theirs  # nothing interrupts it
        await until(driven.clock, lambda: not driven[Link].holder, 1)
        assert await script.ask("chassis speed x 0.1 y 0 z 0;") == "ok"  # it is free
        await until(driven.clock, lambda: driven[Link].holder == US, 1)
        assert str(driven[Lease].last.who).startswith("robomaster 127.0.0.1:")
        assert driven[Health].faults == []
        assert await script.ask("chassis speed x 0 y 0 z 0;") == "ok"
        await driven.clock.sleep(1)
        full = driven[Base].limits.twist.x
        assert float(await other.get_system_parameter("base.max_moving_speed")) == pytest.approx(full)


@pytest.mark.parametrize("back", ["slamware"])
async def test_speed_limit_is_restored_with_the_link(
    back: str, way: Rig, connect: Connect, robot: Robot, rest: OpenRest, world: World
) -> None:
    async with connect() as driven:
        other, full = await rest(robot), driven[Base].limits.twist.x
        await drives(driven, world)
        assert float(await other.get_system_parameter("base.max_moving_speed")) == pytest.approx(SPEED, abs=0.01)
        await cut(way)
        await until(driven.clock, lambda: driven[Link].state is LinkState.LOST)
        await driven.clock.sleep(1)
        await healed(way)
        await until(driven.clock, lambda: driven[Link].state is LinkState.UP)
        assert float(await other.get_system_parameter("base.max_moving_speed")) == pytest.approx(full)
        assert driven[Base].limits.twist.x == pytest.approx(full)


@pytest.mark.slow
@pytest.mark.parametrize("back", ["cyberdog"])
async def test_dog_walked_by_another_app_is_left_alone(
    back: str, way: Rig, connect: Connect, world: World, text_door: Open
) -> None:
    async with connect() as driven:
        script = await text_door(driven)
        async with way.second_app() as app:
            here = driven[Localization].pose
            task = await app.navigate(here.x + 3.0, here.y)
            await until(driven.clock, lambda: driven[Link].holder == OTHERS, 5)
            assert await script.ask("chassis move x 0.3;") == "fail"
            assert await script.ask("chassis speed x 0.3 y 0 z 0;") == "fail"
            assert [each.name for each in driven[Health].faults] == [OUTSIDE]
            await driven[Lease].take("robomaster")
            assert driven[Lease].holder is None
            await until(driven.clock, lambda: task.ended, 2)
            with acting_for("robomaster"):
                await succeeds(driven)
