"""The charging contacts at the rear: whether they touch a dock, by geometry."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.events import DockContactChanged, EventStream
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive

FAR = 4  # ticks that pass until a robot 1 m away is looked at again


class DockContactSection(Struct, frozen=True, forbid_unknown_fields=True):
    """How near (m) and straight (rad) the rear contacts must be to a dock."""

    distance: Positive
    angle: Positive


class SimulatedDockContact(DockContact):
    """Touches when the rear of the hull meets the middle of a dock's front, near and straight enough."""

    def __init__(
        self, section: DockContactSection, hull: Hull, docks: Sequence[Sequence[Pose]], events: EventStream
    ) -> None:
        self._section, self._hull, self._docks, self._events = section, hull, docks, events
        self._far = 0  # ticks that a dock is out of reach at least
        self._docked = self._touches()

    @property
    def docked(self) -> bool:
        return self._docked

    def sense(self, stamp: float, _seconds: float) -> None:
        """Feel for a dock; while none is near, not in every tick."""
        if self._far:
            self._far -= 1
            return
        touches = self._touches()
        if touches != self._docked:
            self._docked = touches
            self._events.publish(DockContactChanged(stamp=stamp, docked=touches))

    def _touches(self) -> bool:
        hull = self._hull
        x, y, radius, near = hull.x, hull.y, hull.body.hull.radius, self._section.distance
        self._far = FAR
        for dock in self._docks[hull.floor]:
            if not (-1.0 <= x - dock.x <= 1.0 and -1.0 <= y - dock.y <= 1.0):
                continue
            self._far = 0
            seen = hull.pose.relative_to(dock)
            if abs(seen.x - radius) <= near and abs(seen.y) <= near and abs(seen.yaw) <= self._section.angle:
                return True
        return False


def _fit(fit: Fitting) -> SimulatedDockContact:
    return SimulatedDockContact(fit.body[DockContactSection], fit.hull, fit.world.docks, fit.robot.events)


PART = Part(
    name="dock_contact",
    interface=DockContact,
    section=DockContactSection,
    fit=_fit,
    sense=SimulatedDockContact.sense,
)
