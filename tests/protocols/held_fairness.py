"""Fairness that makes every client wait while a test says so."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.model.inputs.fairness import Fairness, Use
from roboglot.model.robot import Robot

PATIENCE = 60.0  # real s
PAUSE = 0.005  # s between two looks whether clients still wait


class Held(Fairness):
    """``waited``: clients that had to wait, once for each time. ``counted``: those whose requests were counted."""

    def __init__(self) -> None:
        super().__init__(lambda: 0.0, lambda: 0.0)
        self.on = False
        self.waited: list[str] = []
        self.counted: list[str] = []

    def wait(self, use: Use) -> float:
        if self.on:
            self.waited.append(use.name)
        return PAUSE if self.on else 0.0

    def took(self, use: Use, seconds: float) -> None:
        super().took(use, seconds)
        self.counted.append(use.name)


async def until(condition: Callable[[], object]) -> None:
    """Wait, in real time, for a condition that sockets bring about."""
    async with asyncio.timeout(PATIENCE):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.002)


def held(robot: Robot) -> Held:
    """Return the robot's fairness from now on, which lets no client wait yet."""
    robot.fairness = made = Held()
    return made
