"""Commands of every door to a robot that something hinders: each success is one in the world, too."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.floors import Floors, RideStage
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.system.lease import Lease
from roboglot.model.geometry import Pose
from tests.protocols.commands import (
    COMMANDS,
    drive_by_console,
    move_by_text,
    turn_by_program,
    turn_by_rest,
    undock_by_fleet,
    walk_by_dog,
)
from tests.protocols.every_door import Doors, reported_floors
from tests.protocols.test_restarts import STIRS, Command, Sweep

GOES = {  # m and rad, where nothing hinders it
    turn_by_rest: (0.0, 1.0),
    move_by_text: (0.2, 0.0),
    walk_by_dog: (0.2, 0.0),
    drive_by_console: (0.0, 0.5),
    turn_by_program: (0.0, math.radians(20)),
}
SHARE = 0.15  # of the way by which it may be off
SETTLED = 3.0  # s
FREE = Pose(3.0, 7.0)
Hinder = Callable[[Doors], Awaitable[None]]


async def docked(doors: Doors) -> None:
    """Set it on the dock, which it may leave."""


async def blocked(doors: Doors) -> None:
    """Put a wall 7 cm ahead: it can only turn."""
    doors.world.stage.place("a", FREE)
    ahead = doors.robot.description.radius + 0.07 + 0.05
    doors.world.stage.add_obstacle(Pose(FREE.x + ahead, FREE.y), (0.1, 1.5, 1.0), 0)


async def held(doors: Doors) -> None:
    """Give control to another client."""
    await doors.robot[Lease].take("another")


async def stopped(doors: Doors) -> None:
    """Engage the emergency stop, on the dock."""
    doors.robot[EmergencyStop].engage()


ALL = frozenset(COMMANDS)
LINEAR = frozenset({move_by_text, walk_by_dog})


@pytest.mark.slow  # in short: test_all_doors_tell_the_same
@pytest.mark.timeout(600)
@pytest.mark.parametrize(("hinder", "refused"), [(docked, frozenset()), (blocked, LINEAR), (held, ALL), (stopped, ALL)])
async def test_success_is_one_in_the_world(doors: Doors, hinder: Hinder, refused: frozenset[Command]) -> None:
    sweep, truth = Sweep(doors), doors.world.truth
    await doors.life.forward(2.0)
    await hinder(doors)
    await sweep.wait(SETTLED)
    start = truth.pose_of("a")
    for command in COMMANDS:
        doors.world.stage.place("a", start)
        await sweep.wait(SETTLED)
        was_docked = doors.robot[DockContact].docked
        done = await sweep.give(command)
        await sweep.wait(SETTLED)
        moved = truth.pose_of("a").relative_to(start)
        assert done is (command not in refused), command
        if command is undock_by_fleet:
            assert doors.robot[DockContact].docked is (was_docked and not done)
        elif done:
            metres, radians = GOES[command]
            assert moved.distance_to(Pose()) == pytest.approx(metres, rel=SHARE, abs=STIRS), command
            assert moved.yaw == pytest.approx(radians, rel=SHARE, abs=STIRS), command
        else:
            assert moved.distance_to(Pose()) < (0.1 if hinder is blocked else STIRS), command
            assert abs(moved.yaw) < STIRS, command


@pytest.mark.slow  # in short: test_rides_given_up_at_any_moment
@pytest.mark.timeout(900)
@pytest.mark.world("office")
async def test_command_in_lift_ends_the_ride(doors: Doors) -> None:
    """The car carries the robot on, and all doors tell the floor where it is."""
    robot, sweep, truth = doors.robot, Sweep(doors), doors.world.truth
    waiting, inside = (Pose(x, 10.0, math.pi).relative_to(doors.origin) for x in (2.75, 0.95))
    await doors.life.forward(2.0)
    going = robot[Navigation].navigate_to([waiting.point], NavigationOptions(yaw=waiting.yaw))
    await sweep.until(lambda: going.status.ended)
    robot[Floors].set_lift(waiting, inside)
    for command in COMMANDS:
        ride = robot[Floors].ride(1 - robot[Floors].current)
        await sweep.until(lambda: ride.feedback is RideStage.RIDING)  # noqa: B023 - at once
        start = truth.pose_of("a")
        assert await sweep.give(command), command
        await sweep.wait(SETTLED)
        assert ride.status is ActionStatus.CANCELED
        metres, radians = GOES.get(command, (0.0, 0.0))
        moved = truth.pose_of("a").relative_to(start)
        assert moved.distance_to(Pose()) == pytest.approx(metres, rel=SHARE, abs=STIRS), command
        assert moved.yaw == pytest.approx(radians, rel=SHARE, abs=STIRS), command
        await sweep.wait(20.0)
        await doors.forward(0.5)
        assert {*reported_floors(doors.control.state, await doors.console())} == {truth.floor_of("a")}
