"""Delay of a robot's answers by a slow network."""

from __future__ import annotations

from roboglot.model.components.system.network import Network
from roboglot.model.robot import Robot


def lateness(robot: Robot) -> float:
    """s by which what this robot says comes late now; 0 without a network card."""
    return robot[Network].delay if Network in robot else 0.0


async def late(robot: Robot) -> None:
    """Wait as long as the robot's answers are late now; for code that answers clients."""
    if delay := lateness(robot):
        await robot.clock.sleep(delay)
