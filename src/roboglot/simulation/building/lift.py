"""The building's lift: takes calls, rides, opens and closes its door, and publishes events. Knows no radio.

After a ride it stays with its door open until the next call to another floor.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from roboglot.model.components.logistics.lift_client import LiftDoor, LiftState
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.events import Event, LiftArrived, LiftDoorClosed, LiftDoorOpened, LiftFailed
from roboglot.model.geometry import Pose
from roboglot.simulation.building.blueprint import door_panels
from roboglot.simulation.building.lift_passengers import Passengers
from roboglot.simulation.building.mechanics import Mechanics
from roboglot.simulation.world.description import WorldDescription

HOLD_MAX = 120.0  # s for which a client may keep the door open
CALLS_MAX = 20
BLOCKED_AFTER = 15.0  # s of obstruction after which the door has failed
LEVEL = 0.003  # m within which the car stands level with a floor
SETTLING = 0.3  # s for the car to come to rest at a floor

Listener = Callable[[Event], None]


class LiftCar:
    """One car in one shaft. ``step`` lets time pass; events go to all ``listeners``."""

    def __init__(self, world: WorldDescription, physics: Mechanics, passengers: Passengers) -> None:
        assert world.lift is not None
        self.section, self._physics, self.passengers = world.lift, physics, passengers
        self._heights = [floor.height for floor in world.floors]
        self._elevations = [world.elevation(number) for number in range(len(world.floors))]
        self._base = self._elevations[world.lift.parked_at]
        self.names = tuple(floor.name or str(number) for number, floor in enumerate(world.floors))
        self.listeners: list[Listener] = []
        self.in_service = True
        self._floor = world.lift.parked_at  # the floor where it stands or last stood
        self._target: int | None = None
        self._calls: list[int] = []
        self._opening, self._door = 1.0, LiftDoor.OPEN
        self._open_until = 0.0
        self._riding = False
        self._height, self._speed = self._base, 0.0  # of the servo's set point
        self._level_since = 0.0
        self._obstructed_since: float | None = None
        self._failure = ""
        self._now = 0.0
        for number in range(len(world.floors)):
            self._show_door(number, self._opening if number == self._floor else 0.0)

    @property
    def frame(self) -> Pose:
        """Middle of the car's floor, +x towards its door (world)."""
        return Pose(*self.section.at, math.radians(self.section.facing))

    @property
    def elevation(self) -> float:
        """Elevation of the car's floor, m."""
        return self._base + self._physics.car_lift

    @property
    def floor(self) -> int:
        """Floor nearest to the car."""
        return min(range(len(self._elevations)), key=lambda number: abs(self._elevations[number] - self._height))

    @property
    def rests(self) -> bool:
        """True while it waits for a call, with its door open or closed."""
        return not self._riding and self._door in (LiftDoor.OPEN, LiftDoor.CLOSED) and not self._calls

    @property
    def state(self) -> LiftState:
        """State as broadcast by radio."""
        load = self.passengers.load(self) / self.section.capacity
        return LiftState(self.floor, self._target, self._door, load, self.in_service, bool(self._failure))

    # -- status --

    def call(self, floor: int) -> None:
        """Call the car to a floor. Raises InvalidGoal; Refused if out of service or called too often."""
        if not 0 <= floor < len(self._elevations):
            raise InvalidGoal(f"the lift does not stop at {floor}")
        self._refuse_if_dead()
        if floor in self._calls:
            return
        if len(self._calls) >= CALLS_MAX:
            raise Refused("the lift has too many calls")
        self._calls.append(floor)

    def hold_door(self, seconds: float) -> None:
        """Open the door, or keep it open, for ``seconds``. Raises InvalidGoal; Refused on a ride or out of service."""
        if not 0.0 < seconds <= HOLD_MAX:
            raise InvalidGoal(f"a door is held for up to {HOLD_MAX:g} s, not {seconds}")
        self._refuse_if_dead()
        if self._riding:
            raise Refused("the lift is on its way")
        self._open_until = self._now + seconds
        if self._door is not LiftDoor.OPEN:
            self._door = LiftDoor.OPENING

    def close_door(self) -> None:
        """Close the door as soon as it is free. Raises Refused."""
        self._refuse_if_dead()
        self._open_until = self._now
        if self._door in (LiftDoor.OPEN, LiftDoor.OPENING):
            self._door = LiftDoor.CLOSING

    def take_out_of_service(self, out: bool) -> None:
        """Switch the lift off: it ends its ride and takes no more calls; or on again."""
        if out and self.in_service:
            self._calls.clear()
            self._notify(LiftFailed(stamp=self._now, reason="out of service"))
        self.in_service = not out

    def _refuse_if_dead(self) -> None:
        if not self.in_service:
            raise Refused("the lift is out of service")

    # -- time --

    def step(self, stamp: float, seconds: float) -> None:
        """Let ``seconds`` pass, until ``stamp``."""
        self._now = stamp
        if self._riding:
            self._ride(seconds)
        elif self._door is LiftDoor.OPENING:
            self._move_door(seconds / self.section.door_time)
        elif self._door is LiftDoor.CLOSING:
            self._close(seconds)
        elif self._calls:
            self._answer()

    def _answer(self) -> None:
        """Serve the next call: open the door here, or close it and leave."""
        target = self._calls[0]
        if target == self._floor:
            self._calls.pop(0)
            self._notify(LiftArrived(stamp=self._now, floor=target))
            self._open_until = self._now + self.section.dwell
            if self._door is LiftDoor.CLOSED:
                self._door = LiftDoor.OPENING
            return
        if self._door is LiftDoor.OPEN:
            if self._now < self._open_until or self._overloaded():
                return
            self._door = LiftDoor.CLOSING
            return
        self._target, self._riding = target, True

    def _overloaded(self) -> bool:
        over = self.passengers.load(self) > self.section.capacity
        if over or self._failure == "overloaded":
            self._fail("overloaded" if over else "")
        return over

    def _close(self, seconds: float) -> None:
        """Close the door; if it is obstructed, open it again and wait."""
        if self._opening > 0.0 and self.passengers.in_doorway(self, self._floor):
            if self._obstructed_since is None:
                self._obstructed_since = self._now
            self._door = LiftDoor.OPENING
            self._open_until = self._now + 1.0
            if self._now - self._obstructed_since >= BLOCKED_AFTER:
                self._fail("door blocked")
            return
        self._move_door(-seconds / self.section.door_time)
        if self._opening == 0.0:
            self._obstructed_since = None
            self._fail("")

    def _fail(self, reason: str) -> None:
        if reason and reason != self._failure:
            self._notify(LiftFailed(stamp=self._now, reason=reason))
        self._failure = reason

    def _move_door(self, by: float) -> None:
        self._opening = min(1.0, max(0.0, self._opening + by))
        self._show_door(self._floor, self._opening)
        if self._opening == 1.0:
            self._door = LiftDoor.OPEN
            self._open_until = max(self._open_until, self._now + self.section.dwell)
            self._notify(LiftDoorOpened(stamp=self._now, floor=self._floor))
        elif self._opening == 0.0:
            self._door = LiftDoor.CLOSED
            self._notify(LiftDoorClosed(stamp=self._now, floor=self._floor))

    def _show_door(self, floor: int, opening: float) -> None:
        props, keys = self._physics.props, (f"landing door {floor} {half}" for half in range(2))
        for key, panel in zip(keys, door_panels(self.section, self._heights[floor], opening), strict=True):
            if opening < 1.0:
                props.put(key, floor, panel)
            else:
                props.remove(key)

    def _ride(self, seconds: float) -> None:
        """Move the servo's set point: accelerate, brake in time, settle, arrive."""
        assert self._target is not None
        goal = self._elevations[self._target]
        left = abs(goal - self._height)
        allowed = min(self.section.speed, math.sqrt(2.0 * self.section.acceleration * left))
        self._speed = min(allowed, self._speed + self.section.acceleration * seconds)
        step = max(self._speed * seconds, 1e-4)
        if left > step:
            self._height += math.copysign(step, goal - self._height)
            self._level_since = self._now
        else:
            self._height, self._speed = goal, 0.0
        self._physics.drive_car(self._height - self._base)
        self.passengers.carry(self)
        if self._now - self._level_since >= SETTLING and abs(self.elevation - goal) < LEVEL:
            self._arrive(self._target)

    def _arrive(self, floor: int) -> None:
        self._floor, self._target, self._riding = floor, None, False
        self._calls = [call for call in self._calls if call != floor]
        self._door = LiftDoor.OPENING
        self._notify(LiftArrived(stamp=self._now, floor=floor))

    def _notify(self, event: Event) -> None:
        for listener in self.listeners:
            listener(event)
