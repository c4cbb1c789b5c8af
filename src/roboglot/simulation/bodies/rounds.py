"""A tick of all robots of a world: first kind by kind what is computed together, then robot by robot."""

from __future__ import annotations

from collections.abc import Iterator

from roboglot.simulation.bodies.assembly import SimulatedRobot
from roboglot.simulation.bodies.part import parts
from roboglot.simulation.bodies.rows import Control, Rows, Sense


class Rounds:
    """Control and sensing of the robots of the last tick. ``tick``: s."""

    def __init__(self, rows: Rows, tick: float) -> None:
        self._rows, self._tick = rows, tick
        self._robots: tuple[SimulatedRobot, ...] = ()
        self._controls: list[Control] = []
        self._senses: list[Sense] = []

    def control(self, robots: tuple[SimulatedRobot, ...]) -> None:
        """Run all control of a tick, before its physics."""
        if robots != self._robots:
            self._gather(robots)
        for control in self._controls:
            control(self._tick)
        for robot in robots:
            robot.control()

    def sense(self, robots: tuple[SimulatedRobot, ...], stamp: float) -> Iterator[None]:
        """Run all sensing of a tick, after its physics; yield where other work may come between."""
        for sense in self._senses:
            sense(stamp, self._tick)
        for robot in robots:  # one robot at a time: its data stay in the cache
            robot.sense(stamp)
            yield

    def _gather(self, robots: tuple[SimulatedRobot, ...]) -> None:
        """Make the functions of all robots' parts anew."""
        self._robots = robots
        self._controls.clear()
        self._senses.clear()
        for part in parts():
            if part.control_together is not None:
                moved = [its for robot in robots if (its := robot.control_together(part.name)) is not None]
                self._controls.append(part.control_together(self._rows, moved))
            if part.together is not None:
                found = [one for robot in robots if (one := robot.together(part.name)) is not None]
                self._senses.append(part.together(self._rows, found))
