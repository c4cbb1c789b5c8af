"""Sensing of all robots of a world in a tick: first kind by kind what is computed together, then robot by robot."""

from __future__ import annotations

from collections.abc import Iterator

from roboglot.simulation.bodies.assembly import SimulatedRobot
from roboglot.simulation.bodies.part import parts
from roboglot.simulation.bodies.rows import Rows, Sense


class Rounds:
    """Sensing of the robots of the last tick. ``tick``: s."""

    def __init__(self, rows: Rows, tick: float) -> None:
        self._rows, self._tick = rows, tick
        self._robots: tuple[SimulatedRobot, ...] = ()
        self._together: list[Sense] = []

    def sense(self, robots: tuple[SimulatedRobot, ...], stamp: float) -> Iterator[None]:
        """Run all sensing of a tick; yield where other work may come between."""
        if robots != self._robots:
            self._robots, self._together = robots, list(self._made(robots))
        for sense in self._together:
            sense(stamp, self._tick)
        for robot in robots:  # one robot at a time: its data stay in the cache
            robot.sense(stamp)
            yield

    def _made(self, robots: tuple[SimulatedRobot, ...]) -> Iterator[Sense]:
        for part in parts():
            if part.together is not None:
                found = [one for robot in robots if (one := robot.together(part.name)) is not None]
                if found:
                    yield part.together(self._rows, found)
