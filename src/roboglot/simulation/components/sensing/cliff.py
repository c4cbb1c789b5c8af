"""Cliff sensors at the hull's rim. Over a drop they bar driving in its direction, for every kind of motion."""

from __future__ import annotations

import math

from msgspec import Struct

from roboglot.model.components.sensing.cliff import Cliff
from roboglot.model.events import CliffCleared, CliffDetected, EventStream
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.building.floor_edges import FloorEdges
from roboglot.simulation.components.motion.base import SimulatedBase

WHO = "the cliff sensor"
PLACES = {  # direction in base_link, as shares of the hull's radius
    "front": (1.0, 0.0),
    "front left": (0.78, 0.63),
    "front right": (0.78, -0.63),
    "rear": (-1.0, 0.0),
}


class CliffSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Sensors at the hull's rim that look ``ahead`` m beyond it."""

    ahead: NotNegative


class SimulatedCliff(Cliff):
    """Cliff sensors that check for floor under each zone; cheap while no edge is near."""

    zones = tuple(PLACES)

    def __init__(
        self, section: CliffSection, hull: Hull, base: SimulatedBase, footing: FloorEdges, events: EventStream
    ) -> None:
        self._hull, self._base, self._footing, self._events = hull, base, footing, events
        self._reach = hull.body.hull.radius + section.ahead
        self._detected: frozenset[str] = frozenset()
        self._fooled: frozenset[str] = frozenset()
        self.duty = hull.edges.call(Duty(), self._reach)
        self.masked: frozenset[str] = frozenset()  # zones that do not report

    @property
    def detected(self) -> frozenset[str]:
        return self._detected

    @property
    def fooled(self) -> frozenset[str]:
        """Zones that report a drop without one."""
        return self._fooled

    @fooled.setter
    def fooled(self, zones: frozenset[str]) -> None:
        self._fooled = zones
        self.duty.begin()

    def sense(self, stamp: float, _seconds: float) -> None:
        """Update the zones above a drop, and bar driving towards it."""
        hull = self._hull
        near = self._footing.ends_near(hull.x, hull.y, hull.floor, hull.elevation, self._reach)
        if not near and not self._detected and not self._fooled:
            if not hull.edges.near:
                self.duty.end()
            return
        seen = (self._look() if near else self._fooled) - self.masked
        before, self._detected = self._detected, seen
        if seen == before:
            return
        ahead, behind = any("front" in zone for zone in seen), "rear" in seen
        reason = f"the floor ends {'ahead' if ahead else 'behind'}"
        self._base.hindrances.bar(WHO, ahead=ahead, behind=behind, reason=reason)
        for zone in self.zones:
            if zone in seen and zone not in before:
                self._events.publish(CliffDetected(stamp=stamp, zone=zone))
            elif zone in before and zone not in seen:
                self._events.publish(CliffCleared(stamp=stamp, zone=zone))

    def _look(self) -> frozenset[str]:
        pose, floor, elevation = self._hull.pose, self._hull.floor, self._hull.elevation
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        seen = set(self._fooled)
        for zone, (along, aside) in PLACES.items():
            x, y = self._reach * along, self._reach * aside
            if self._footing.missing(pose.x + c * x - s * y, pose.y + s * x + c * y, floor, elevation):
                seen.add(zone)
        return frozenset(seen)


def _fit(fit: Fitting) -> SimulatedCliff:
    footing = fit.world.building.footing
    return SimulatedCliff(fit.body[CliffSection], fit.hull, fit.get(SimulatedBase), footing, fit.robot.events)


PART = Part(
    name="cliff",
    interface=Cliff,
    section=CliffSection,
    fit=_fit,
    after=("base", "fall_guard"),
    sense=SimulatedCliff.sense,
    duty=lambda cliff: cliff.duty,
)
