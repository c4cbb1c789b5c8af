"""Delay of a robot's responses by a slow network."""

from __future__ import annotations

from roboglot.model.components.system.network import Network
from roboglot.model.robot import Robot


def response_delay(robot: Robot) -> float:
    """Return the current delay of this robot's responses, s; 0 without a network card."""
    return robot[Network].delay if Network in robot else 0.0


async def delay_response(robot: Robot) -> None:
    """Wait for the current delay of the robot's responses; call it before sending one."""
    if delay := response_delay(robot):
        await robot.clock.sleep(delay)
