"""Steps of the tests of bad links: commands to a robot behind one, and checks of what it does."""

import asyncio
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import Clock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Unconnected
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from tests.drivers.rig import Rig

BACKS = ("slamware", "robomaster", "cyberdog")
SPEED = 0.3  # m/s
Connect = Callable[[], AbstractAsyncContextManager[Robot]]


async def cut(way: Rig) -> None:
    way.fault.refusing = True
    way.cut()


async def healed(way: Rig) -> None:
    way.fault.heal()
    way.cut()


async def until(clock: Clock, condition: Callable[[], object], patience: float = 30.0) -> float:
    """Wait for it; how long that took, robot s."""
    begun = clock.time()
    while not condition():
        assert clock.time() - begun < patience, "it did not happen"
        await clock.sleep(0.02)
    return clock.time() - begun


async def drives(driven: Robot, world: World) -> Action:
    """Under way by hand, at full speed."""
    action, start = driven[Driving].drive(Twist(x=SPEED), source="test"), world.truth.pose_of("a")
    await until(driven.clock, lambda: world.truth.pose_of("a").distance_to(start) > 0.3, 5)
    return action


async def stands(world: World, clock: Clock) -> None:
    before = world.truth.pose_of("a")
    await clock.sleep(0.4)
    assert world.truth.pose_of("a").distance_to(before) < 0.01


async def refused(driven: Robot) -> None:
    """Moving: at once."""
    try:
        action = driven[Driving].move_by(Pose(x=1.0), source="test")
    except Unconnected:
        return
    await driven.clock.sleep(0.1)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, Unconnected)


async def succeeds(driven: Robot, patience: float = 20.0, speed: float | None = None) -> None:
    action = driven[Driving].move_by(Pose(x=0.2), speed=speed, source="test")
    async with asyncio.timeout(60):
        await until(driven.clock, lambda: action.status.ended, patience)
    assert action.status is ActionStatus.SUCCEEDED, action.reason


async def succeeds_slowly(driven: Robot, world: World, tries: int = 3) -> Pose:
    """Return the start of the move of 0.2 m at 0.1 m/s; again where this machine paused for longer than the link."""
    for left in reversed(range(tries)):
        start = world.truth.pose_of("a")
        try:
            await succeeds(driven, speed=0.1)
        except AssertionError as failed:
            if "cannot settle" not in str(failed) or not left:
                raise
        else:
            break
    return start
