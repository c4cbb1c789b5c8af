"""A tick of all robots of a world: first parts computed for all robots at once, then robot by robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from heapq import heappop, heappush

from roboglot.simulation.bodies.assembly import SimulatedRobot
from roboglot.simulation.bodies.part import parts
from roboglot.simulation.bodies.schedule import Schedule
from roboglot.simulation.bodies.tables import BatchedControl, BatchedSense, RobotTables

LAST = 1 << 60  # after all


class DueSchedules:
    """Finds the schedules with something due in a tick, in their order, without looking at the others.

    ``number`` is the index of a schedule. ``before``: for each schedule, the world's tick before its first one.
    ``before_change``: see ``RobotTables``.
    """

    def __init__(
        self, schedules: Sequence[Schedule], before: Sequence[int], tick: int, before_change: Callable[[], None]
    ) -> None:
        """``tick``: the last tick that has passed."""
        self._schedules, self._before, self._tick = schedules, before, tick
        self._before_change = before_change
        self._booked = [0] * len(schedules)  # the next tick of each in which something is due
        self._due: dict[int, list[int]] = {}  # by tick; entries that differ from ``_booked`` are out of date
        self._left: list[int] = []  # heap of the present tick
        self._at = LAST  # the one whose turn it is
        for number, schedule in enumerate(schedules):
            schedule.changed = partial(self._change, number)
            self._book(number, tick)

    def begin(self, tick: int) -> Iterator[int]:
        """Yield those that are due in ``tick``, also those that become due before their turn."""
        for number in self._left:  # an error ended the last tick early
            self._book(number, self._tick)
        self._tick, self._left = tick, sorted(self._due.pop(tick, ()))
        while self._left:
            number = heappop(self._left)
            if self._booked[number] == tick:
                self._at, self._booked[number] = number, 0
                try:
                    yield number
                finally:
                    self._book(number, tick)
        self._at = LAST

    def skip(self, tick: int) -> None:
        """Note that the ticks up to this one have passed, in which nothing was due."""
        self._tick = tick

    def due(self, tick: int) -> bool:
        """Return whether something may be due in a later tick."""
        return tick in self._due or bool(self._left)

    def _change(self, number: int) -> None:
        """Note that a duty of a schedule began or ended."""
        self._before_change()
        if number != self._at:
            self._book(number, self._tick - (number > self._at))

    def _book(self, number: int, tick: int) -> None:
        """Book a schedule's next tick after this one."""
        later = self._schedules[number].next_after(tick - self._before[number])
        if later and (later := later + self._before[number]) != self._booked[number]:
            if later == self._tick:
                heappush(self._left, number)
            else:
                self._due.setdefault(later, []).append(number)
        self._booked[number] = later


class RobotTicks:
    """Control and sensing of the robots. ``tick``: s.

    ``controls`` and ``senses``: functions for all robots at once, in every tick; the caller runs ``senses``.
    """

    def __init__(self, tables: RobotTables, tick: float) -> None:
        self._tables, self._tick = tables, tick
        self._robots: tuple[SimulatedRobot, ...] = ()
        self.controls: list[BatchedControl] = []
        self.senses: list[BatchedSense] = []
        self._ahead: list[Callable[[int], None]] = []
        self.gathered = 0  # number of times that these were made
        self._ticks = 0
        self._controlled = self._sensed = DueSchedules((), (), 0, tables.before_change)

    def control(self, robots: tuple[SimulatedRobot, ...], *, lean: bool = False) -> bool:
        """Run all control of the next tick, before its physics; if ``lean``, only if a robot has something due.

        Return whether it ran.
        """
        if robots != self._robots:
            self._gather(robots)
        tick = self._ticks + 1
        if lean and not self._controlled.due(tick):
            self._controlled.skip(tick)
            return False
        self._controlled.skip(tick - 1)
        for control in self.controls:
            control(self._tick)
        for number in self._controlled.begin(tick):
            robots[number].control(tick)
        return True

    def free(self, most: int) -> int:
        """Return how many ticks, 1 to ``most``, can pass before a robot has something due.

        That is, control after the first of them, or sensing before the last.
        """
        tick = self._ticks
        for ahead in range(1, most):
            if self._sensed.due(tick + ahead) or self._controlled.due(tick + ahead + 1):
                return ahead
        return most

    def idle(self, most: int) -> int:
        """Return how many of the next ticks, up to ``most``, pass before a robot has something due."""
        for ahead in range(1, most + 1):
            if self._sensed.due(self._ticks + ahead) or self._controlled.due(self._ticks + ahead):
                return ahead - 1
        return most

    def skip(self, ticks: int) -> None:
        """Note that so many ticks have passed; sensing of the last one is still to come."""
        if not ticks:
            return
        self._ticks += ticks
        self._controlled.skip(self._ticks)
        self._sensed.skip(self._ticks - 1)

    def rest(self, ticks: int) -> None:
        """Note that so many ticks have passed, in which nothing was due."""
        self._ticks += ticks
        self._controlled.skip(self._ticks)
        self._sensed.skip(self._ticks)

    def sense(self, robots: tuple[SimulatedRobot, ...], stamp: float) -> Iterator[None]:
        """Run the sensing that is due in the last tick; yield where other work may come between."""
        tick = self._ticks
        for compute in self._ahead:
            compute(tick)
        if not self._sensed.due(tick):
            self._sensed.skip(tick)
            return
        for number in self._sensed.begin(tick):  # one robot at a time: its data stay in the cache
            robots[number].sense(tick, stamp)
            yield

    def _gather(self, robots: tuple[SimulatedRobot, ...]) -> None:
        """Make the functions of all robots' parts again."""
        self._robots = robots
        self.gathered += 1
        self.controls.clear()
        self.senses.clear()
        self._ahead.clear()
        for part in parts():
            if part.control_all is not None:
                moved = [its for robot in robots if (its := robot.batched_control(part.name)) is not None]
                self.controls.append(part.control_all(self._tables, moved))
            if part.sense_all is not None:
                found = [one for robot in robots if (one := robot.batched_sense(part.name)) is not None]
                self.senses.append(part.sense_all(self._tables, found))
            if part.ahead is not None:
                early = [it for robot in robots if (it := robot.ahead(part.name)) is not None]
                self._ahead += [part.ahead(self._tables, early)] if early else []
        for robot in robots:
            if robot.before is None:
                robot.before = self._ticks
        before = [robot.before or 0 for robot in robots]
        change = self._tables.before_change
        self._controlled = DueSchedules([robot.controls for robot in robots], before, self._ticks, change)
        self._sensed = DueSchedules([robot.senses for robot in robots], before, self._ticks, change)
