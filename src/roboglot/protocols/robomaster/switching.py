"""Switches that a real robot behind this door may refuse."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.confirmation import confirmed
from roboglot.model.errors import RobotError


async def switch_or_undo(switch: Callable[[], None], undo: Callable[[], None]) -> None:
    """Call ``switch``, and ``undo`` if the robot refuses: a repeated command must not find it switched.

    Raises the robot's error.
    """
    try:
        async with confirmed():
            switch()
    except RobotError:
        undo()
        raise
