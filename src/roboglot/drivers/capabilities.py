"""Adds the components that a driver finds on a robot. Independent of the protocol."""

from __future__ import annotations

from collections.abc import Awaitable

from roboglot.clients.errors import BadAnswer, ClientError, RefusedByRobot, TimedOut
from roboglot.model.robot import C, Robot

ABSENT = (RefusedByRobot, BadAnswer, TimedOut)  # how robots answer for a component that they lack


async def add_if_present(
    robot: Robot,
    interface: type[C],
    part: C,
    learn: Awaitable[None] | None = None,
    *,
    absent: tuple[type[ClientError], ...] = ABSENT,
) -> bool:
    """Add ``part`` unless the probe ``learn`` raises one of ``absent``; return True if the robot has it.

    A component stays once it was added: its age and its refusals show that it is gone. Other errors are raised.
    """
    if learn is not None:
        try:
            await learn
        except absent:
            return False
    if interface not in robot:
        robot.add(interface, part)
    return True
