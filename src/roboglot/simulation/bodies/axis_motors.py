"""Motors that move one axis over time, and the loop of an action that waits for them.

Knows no robot: gimbal, arm, gripper and servos are made of these.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from roboglot.model.actions import Action
from roboglot.model.clock import Clock
from roboglot.values import dataclass

SETTLED = math.radians(0.1)  # an axis returning to its centre rests within this
LOOK = 0.02  # s between checks whether a motion has ended


@dataclass(slots=True)
class Axis:
    """An angle (rad) or a distance (m) between two ends, with limited acceleration (per s2)."""

    lowest: float
    highest: float
    acceleration: float
    position: float = 0.0
    rate: float = 0.0

    def run(self, rate: float, seconds: float) -> None:
        """Approach ``rate`` (per s) and move at it; the ends stop the axis."""
        step = self.acceleration * seconds
        self.rate += max(-step, min(step, rate - self.rate))
        self.shift(self.rate * seconds)

    def trail(self, way: float, pull: float, top: float, seconds: float) -> None:
        """Shift by ``way``, then return to the middle at ``pull`` (1/s) times the distance, up to ``top``.

        Combines ``shift`` and ``run`` for speed: a gimbal calls it in every tick of a turning robot.
        """
        position, rate, low, high = self.position + way, self.rate, self.lowest, self.highest
        if not low <= position <= high:
            position, rate = (low if position < low else high), 0.0
        wanted = -pull * position
        if abs(position) < SETTLED and abs(rate) < pull * SETTLED:
            self.position = self.rate = 0.0
            return
        wanted = top if wanted > top else -top if wanted < -top else wanted
        step, more = self.acceleration * seconds, wanted - rate
        rate += step if more > step else -step if more < -step else more
        position += rate * seconds
        if not low <= position <= high:
            position, rate = (low if position < low else high), 0.0
        self.position, self.rate = position, rate

    def approach(self, goal: float, speed: float, seconds: float) -> None:
        """Approach ``goal`` at up to ``speed``, braking in time to stop there."""
        left = goal - self.position
        step = self.acceleration * seconds
        top = min(speed, math.sqrt(2.0 * self.acceleration * abs(left)), abs(self.rate) + step)
        if abs(left) <= max(top * seconds, 1e-9):
            self.position, self.rate = goal, 0.0
            return
        wanted = math.copysign(top, left)
        if self.rate * left < 0.0:  # moving the wrong way: brake first
            wanted = self.rate + math.copysign(min(step, abs(self.rate)), left)
        self.rate = wanted
        self.shift(wanted * seconds)

    def shift(self, way: float) -> None:
        """Move by ``way`` at once; the ends stop the axis."""
        there = self.position + way
        self.position = max(self.lowest, min(self.highest, there))
        if self.position != there:
            self.rate = 0.0


async def move(
    action: Action, clock: Clock, begin: Callable[[], None], arrived: Callable[[], bool], halt: Callable[[], None]
) -> None:
    """Begin a motion and wait until it has arrived; ``halt`` is called on pauses and at any end."""
    begin()
    try:
        while not arrived():
            if await action.hold(halt):
                begin()
            await clock.sleep(LOOK)
    finally:
        halt()
