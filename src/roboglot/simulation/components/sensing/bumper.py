"""Four touch zones around the hull, from the contacts in the physics."""

from __future__ import annotations

import math

from msgspec import Struct

from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.events import BumperPressed, BumperReleased, EventStream
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.schedule import Duty


class BumperSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Four zones around the hull; ``touch_speed``: speed limit towards obstacles that its feelers detect, m/s."""

    touch_speed: Positive = 0.1


MIDDLES = {"front": (1.0, 0.0), "left": (0.0, 1.0), "rear": (-1.0, 0.0), "right": (0.0, -1.0)}  # of the zones


class SimulatedBumper(Bumper):
    """Bumper with zones of 90 degrees. Docks and light things do not press it."""

    zones = tuple(MIDDLES)

    def __init__(self, hull: Hull, events: EventStream) -> None:
        self._hull, self._events = hull, events
        self._pressed: frozenset[str] = frozenset()
        self._stuck: frozenset[str] = frozenset()
        self.duty = Duty()  # active while the hull is touched, or a switch hangs
        hull.when_touched.append(self.duty)
        self.reactions: list[Duty] = []  # duties of components that read it while it is active
        self.masked: frozenset[str] = frozenset()  # zones that do not report
        self.touched = False  # whether the hull is touched, or was in the last tick
        self.bearings: tuple[tuple[float, float], ...] = ()  # directions of contact: unit vectors, base_link

    @property
    def pressed(self) -> frozenset[str]:
        return self._pressed

    @property
    def stuck(self) -> frozenset[str]:
        """Zones whose switches are stuck."""
        return self._stuck

    @stuck.setter
    def stuck(self, zones: frozenset[str]) -> None:
        self._stuck = zones
        self.duty.begin()

    def sense(self, stamp: float, _seconds: float) -> None:
        """Update the pressed zones by the hull's contacts."""
        self.touched = bool(self._hull.touches or self._pressed or self._stuck)
        if not self.touched:
            self.duty.end()
            return
        for duty in self.reactions:
            duty.begin()
        touches = [(touch.x, touch.y) for touch in self._hull.touches if not touch.light]
        where = {place: zone_of(*place) for place in touches}
        pressed = self.stuck.union(where.values()) - self.masked
        touched = [place for place, zone in where.items() if zone in pressed]
        touched += [MIDDLES[zone] for zone in self.stuck & pressed]
        self.bearings = tuple((x / away, y / away) for x, y in touched if (away := math.hypot(x, y)) > 0.0)
        before, self._pressed = self._pressed, pressed
        if pressed == before:
            return
        for zone in self.zones:
            if zone in pressed and zone not in before:
                self._events.publish(BumperPressed(stamp=stamp, zone=zone))
            elif zone in before and zone not in pressed:
                self._events.publish(BumperReleased(stamp=stamp, zone=zone))


def zone_of(x: float, y: float) -> str:
    """Return the zone of a point in base_link."""
    if abs(x) >= abs(y):
        return "front" if x > 0 else "rear"
    return "left" if y > 0 else "right"


def _fit(fit: Fitting) -> SimulatedBumper:
    return SimulatedBumper(fit.hull, fit.robot.events)


PART = Part(
    name="bumper",
    interface=Bumper,
    section=BumperSection,
    fit=_fit,
    sense=SimulatedBumper.sense,
    duty=lambda bumper: bumper.duty,
)
