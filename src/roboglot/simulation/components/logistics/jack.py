"""The jack: lifts the shelf above the robot, and carries it along."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from msgspec import Struct

from roboglot.model.actions import Action
from roboglot.model.components.logistics.jack import JACK, Jack, JackStage
from roboglot.model.errors import Blocked, Refused
from roboglot.model.events import JackChanged
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.building.shelves import ShelfStand

LOOK = 0.02  # s between steps


class JackSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A platform on the hull; ``time``: s for the full ``stroke`` (m)."""

    stroke: Positive
    time: Positive


class SimulatedJack(Jack):
    """Jack whose top is level with the hull's while down."""

    def __init__(self, section: JackSection, hull: Hull, shelves: Sequence[ShelfStand], robot: Robot) -> None:
        self.stroke = section.stroke
        self._section, self._hull, self._shelves, self._robot = section, hull, shelves, robot
        self._position = 0.0
        self._moving = 0
        self._shelf: ShelfStand | None = None
        self.carrying = Duty()  # active while it holds a shelf
        self._offset = Pose()  # of the shelf in base_link
        self._free: tuple[Pose, frozenset[Hashable]] = Pose(), frozenset()  # where the shelf was, its contacts there
        self._alarm = ""
        self.jammed = False  # whether the drive fails
        self._published: tuple[JackStage, bool, str] = (JackStage.DOWN, False, "")

    @property
    def stage(self) -> JackStage:
        if self._moving:
            return JackStage.MOVING
        if self._position <= 0.0:
            return JackStage.DOWN
        return JackStage.UP if self._position >= self.stroke else JackStage.STOPPED

    @property
    def position(self) -> float:
        return self._position

    @property
    def loaded(self) -> bool:
        return self._shelf is not None

    @property
    def alarm(self) -> str:
        return self._alarm

    def raise_platform(self, *, source: str = "") -> Action:
        return self._start("raise the jack", 1, source)

    def lower_platform(self, *, source: str = "") -> Action:
        return self._start("lower the jack", -1, source)

    def clear_alarm(self) -> None:
        self._alarm = ""
        self._publish()

    def sense(self, _stamp: float, _seconds: float) -> None:
        """Move the shelf with the robot after every tick; halt the robot if the shelf meets an obstacle."""
        if self._shelf is None:
            return
        hull, lifted = self._hull, self._lifted(self._shelf)
        if self._shelf.pose != hull.pose.compose(self._offset):
            met = self._shelf.meets(hull.pose.compose(self._offset), hull.floor, lifted)
            before, met_before = self._free
            if met - met_before:
                hull.halt_at(before)
            else:
                self._free = hull.pose, met
        self._shelf.move(hull.pose.compose(self._offset), hull.floor, lifted)

    def displaced(self) -> None:
        """Accept the new place of robot and load: obstacles that the load overlaps there do not stop the robot."""
        if self._shelf is not None:
            pose, floor = self._hull.pose.compose(self._offset), self._hull.floor
            self._free = self._hull.pose, self._shelf.meets(pose, floor, self._lifted(self._shelf))

    def _start(self, name: str, direction: int, source: str) -> Action:
        if self._alarm:
            raise Refused(f"the jack is in alarm: {self._alarm}")

        async def run(action: Action) -> None:
            await self._move(action, direction)

        return self._robot.actions.start(name, run, resources={JACK}, source=source, pausable=True)

    async def _move(self, action: Action, direction: int) -> None:
        end = self.stroke if direction > 0 else 0.0
        step = direction * self.stroke * LOOK / self._section.time
        try:
            while self._position != end:
                self._moving = direction
                self._publish()
                await action.hold(self._stop)
                await self._robot.clock.sleep(LOOK)
                if self.jammed:
                    self._alarm = "the drive does not move"
                    raise Blocked(self._alarm)
                self._position = min(self.stroke, max(0.0, self._position + step))
                self._meet_shelf()
        finally:
            self._stop()

    def _stop(self) -> None:
        self._moving = 0
        self._publish()

    def _lifted(self, shelf: ShelfStand) -> float:
        """Return the height of the shelf at the platform's position, m; negative: not touched."""
        return self._hull.body.hull.height + self._position - shelf.shelf.clearance

    def _meet_shelf(self) -> None:
        """Take up a shelf when the platform touches its board; set it down when its legs touch the floor."""
        if self._shelf is None:
            for shelf in self._shelves:
                if (
                    shelf.lifted <= 0.0
                    and self._lifted(shelf) > 0.0
                    and shelf.covers(self._hull.pose, self._hull.floor)
                ):
                    self.carrying.begin()
                    self._shelf, self._offset = shelf, shelf.pose.relative_to(self._hull.pose)
                    self._free = self._hull.pose, shelf.meets(shelf.pose, shelf.floor, 0.0)
                    self._publish()
        elif self._lifted(self._shelf) <= 0.0:
            self._shelf.move(self._shelf.pose, self._shelf.floor, 0.0)
            self._shelf = None
            self.carrying.end()
            self._publish()

    def _publish(self) -> None:
        now = self.stage, self.loaded, self._alarm
        if now != self._published:
            self._published = now
            stamp = self._robot.clock.time()
            self._robot.events.publish(JackChanged(stamp=stamp, stage=now[0], alarm=now[2]))


def _fit(fit: Fitting) -> SimulatedJack:
    return SimulatedJack(fit.body[JackSection], fit.hull, fit.world.building.shelves, fit.robot)


PART = Part(
    name="jack",
    interface=Jack,
    section=JackSection,
    fit=_fit,
    sense=SimulatedJack.sense,
    duty=lambda jack: jack.carrying,
    displaced=SimulatedJack.displaced,
)
