"""Actions that drive the robot: it stands up first and brakes last.

Knows no goal: driving, navigation and docking bring theirs.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.errors import EmergencyStopped, Refused, Unconnected
from roboglot.model.geometry import STILL
from roboglot.model.robot import Robot

PERIOD = 0.02  # s between two commands to the base
BRAKING_MAX = 3.0  # s to wait for wheels that still turn
STANDSTILL_SPEED = 0.01  # m/s
STANDSTILL_YAW_RATE = 0.03  # rad/s


def start_on_base(
    robot: Robot, name: str, run: Callable[[Action], Awaitable[None]], *, goal: object, source: str
) -> Action:
    """Start ``run(action)``, which can be paused, holding the base; a lying robot stands up first.

    Raises EmergencyStopped while the legs are limp.
    """
    if Legs in robot and robot[Legs].posture is Posture.LIMP:
        raise EmergencyStopped("the robot is limp after an emergency stop: it has to stand up first")
    rising = None
    if Legs in robot and robot[Legs].posture is not Posture.STANDING:
        rising = robot[Legs].stand(source=source)

    async def stand_then_run(action: Action) -> None:
        if Legs in robot and robot[Legs].posture is not Posture.STANDING:
            raise rising.error.again() if rising and rising.error else Refused("the robot does not stand")
        async with braking_at_the_end(robot, action):
            await run(action)

    return robot.actions.start(
        name, stand_then_run, resources={BASE}, goal=goal, source=source, after=rising, pausable=True
    )


@asynccontextmanager
async def braking_at_the_end(robot: Robot, action: Action) -> AsyncIterator[None]:
    """Stop the base at any end of the block, unless another action takes over its motion."""
    try:
        yield
    except asyncio.CancelledError:
        if action.hands_over and action.status is ActionStatus.CANCELING:
            raise
        if action.brakes_hard:
            robot[Base].brake_hard()
        else:
            robot[Base].set_velocity(STILL)
        if action.status is ActionStatus.CANCELING:  # otherwise the loop is closing and its clock may not move again
            await stand_still(robot)
        raise
    except BaseException:
        await _brake(robot, action)
        raise
    else:
        await _brake(robot, action)


async def _brake(robot: Robot, action: Action) -> None:
    """Stand still, even if ``action`` is cancelled while it brakes: the next action begins from rest."""
    try:
        await stand_still(robot)
    except asyncio.CancelledError:
        if action.status is ActionStatus.CANCELING:
            await stand_still(robot)
        raise


async def stand_still(robot: Robot) -> None:
    """Brake and wait until the wheels have stopped, or their state is unknown."""
    base, clock = robot[Base], robot.clock
    base.set_velocity(STILL)
    deadline = clock.time() + BRAKING_MAX
    if base.delay > 0.0:
        await clock.sleep(base.delay)  # until then the base reports its earlier motion
    while clock.time() < deadline and not isinstance(base.refusal, Unconnected):
        velocity = base.velocity
        if velocity.speed < STANDSTILL_SPEED and abs(velocity.yaw) < STANDSTILL_YAW_RATE:
            return
        await clock.sleep(PERIOD)
