"""Reset of a simulated robot: back to its start in the world, and to the map of the floor there."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from roboglot.model.components.mapping.floors import Floors
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage


async def reset(robot: Robot, stage: Stage, stop: Callable[[], Awaitable[object]]) -> None:
    """Put ``robot`` back to its start once ``stop`` has stopped it. Raises Refused if something is in the way.

    On a floor with another map it uses that one, where its lidar has to find it, as after being carried there.
    """
    stage.refuse_reset(robot.id)
    await stop()
    stage.reset(robot.id)
    floor = next(placed.floor for placed in stage.robots if placed.name == robot.id)
    if Floors in robot:
        await robot[Floors].be_carried(floor)
