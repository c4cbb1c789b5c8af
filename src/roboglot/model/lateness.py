"""Delay of a robot's answers by a slow network."""

from __future__ import annotations

from roboglot.model.components.system.network import Network
from roboglot.model.robot import Robot


def lateness(robot: Robot) -> float:
    """Return the present delay of this robot's answers, s; 0 without a network card."""
    return robot[Network].delay if Network in robot else 0.0


async def late(robot: Robot) -> None:
    """Wait for the present delay of the robot's answers, before sending one."""
    if delay := lateness(robot):
        await robot.clock.sleep(delay)
