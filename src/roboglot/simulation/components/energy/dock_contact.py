"""The charging contacts at the rear, which touch a dock by geometry."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.events import DockContactChanged, EventStream
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive

NEAR = 1.0  # m along an axis within which docks are checked in every tick
SELDOM = 0.5  # s between two checks far from docks: a dock may be moved
FASTEST = 5.0  # m/s at which a robot may approach a dock at most


class DockContactSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Tolerances of the rear contacts at a dock: ``distance`` (m) and ``angle`` (rad)."""

    distance: Positive
    angle: Positive


class SimulatedDockContact(DockContact):
    """Contact while the hull's rear is at the middle of a dock's front, within the tolerances."""

    def __init__(
        self, section: DockContactSection, hull: Hull, docks: Sequence[Sequence[Pose]], events: EventStream
    ) -> None:
        self._section, self._hull, self._docks, self._events = section, hull, docks, events
        self._far = 0.0  # stamp until which docks are out of reach
        self._felt: tuple[object, ...] = ()  # the last checked place of the robot and of the docks
        self._docked, _ = self._touches()

    @property
    def docked(self) -> bool:
        return self._docked

    def sense(self, stamp: float, _seconds: float) -> None:
        """Check for a dock; seldom while none is near."""
        if stamp < self._far:
            return
        hull = self._hull
        here = hull.x, hull.y, hull.turned, hull.floor, *self._docks[hull.floor]
        if here == self._felt:  # neither has moved
            return
        self._felt = here
        touches, away = self._touches()
        self._far = stamp + away / FASTEST
        if touches != self._docked:
            self._docked = touches
            self._events.publish(DockContactChanged(stamp=stamp, docked=touches))

    def displaced(self) -> None:
        """Check again: the robot was lifted and put elsewhere."""
        self._far = 0.0

    def _touches(self) -> tuple[bool, float]:
        """Return whether the robot touches a dock, and the least distance to any dock's reach, m."""
        hull, away = self._hull, SELDOM * FASTEST
        x, y, radius, near = hull.x, hull.y, hull.body.hull.radius, self._section.distance
        for dock in self._docks[hull.floor]:
            off = max(abs(x - dock.x), abs(y - dock.y)) - NEAR
            away = min(away, max(0.0, off))
            if off > 0.0:
                continue
            seen = hull.pose.relative_to(dock)
            if abs(seen.x - radius) <= near and abs(seen.y) <= near and abs(seen.yaw) <= self._section.angle:
                return True, 0.0
        return False, away


def _fit(fit: Fitting) -> SimulatedDockContact:
    return SimulatedDockContact(fit.body[DockContactSection], fit.hull, fit.world.docks, fit.robot.events)


PART = Part(
    name="dock_contact",
    interface=DockContact,
    section=DockContactSection,
    fit=_fit,
    sense=SimulatedDockContact.sense,
    displaced=SimulatedDockContact.displaced,
)
