"""Adds to a robot what its driver found it to have. Knows no protocol."""

from __future__ import annotations

from collections.abc import Awaitable

from roboglot.clients.errors import BadAnswer, ClientError, RefusedByRobot, TimedOut
from roboglot.model.robot import C, Robot

ABSENT = (RefusedByRobot, BadAnswer, TimedOut)  # how robots are silent about a part that they do not have


async def add_if_present(
    robot: Robot,
    interface: type[C],
    part: C,
    learn: Awaitable[None] | None = None,
    *,
    absent: tuple[type[ClientError], ...] = ABSENT,
) -> bool:
    """``part``, unless ``learn`` (which asks the robot for it) ends with ``absent``; whether it is there now.

    A part that was there once stays: it tells by its age and its refusals that it is gone. Other errors are raised.
    """
    if learn is not None:
        try:
            await learn
        except absent:
            return False
    if interface not in robot:
        robot.add(interface, part)
    return True
