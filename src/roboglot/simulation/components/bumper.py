"""Four touch zones around the hull, from the contacts that the physics finds."""

from __future__ import annotations

from roboglot.model.components.bumper import Bumper
from roboglot.model.events import BumperPressed, BumperReleased, EventStream
from roboglot.simulation.hull import Hull


class SimulatedBumper(Bumper):
    """Zones of 90 degrees. A dock's contact springs do not press it."""

    zones = ("front", "left", "rear", "right")

    def __init__(self, hull: Hull, events: EventStream) -> None:
        self._hull, self._events = hull, events
        self._pressed: frozenset[str] = frozenset()
        self.stuck: frozenset[str] = frozenset()  # zones whose switches hang
        self.masked: frozenset[str] = frozenset()  # zones that report nothing

    @property
    def pressed(self) -> frozenset[str]:
        return self._pressed

    def sense(self, stamp: float) -> None:
        """Look at what touches."""
        if not self._hull.touches and not self._pressed and not self.stuck:
            return
        pressed = self.stuck.union(_zone(touch.x, touch.y) for touch in self._hull.touches) - self.masked
        before, self._pressed = self._pressed, pressed
        if pressed == before:
            return
        for zone in self.zones:
            if zone in pressed and zone not in before:
                self._events.publish(BumperPressed(stamp=stamp, zone=zone))
            elif zone in before and zone not in pressed:
                self._events.publish(BumperReleased(stamp=stamp, zone=zone))


def _zone(x: float, y: float) -> str:
    """The zone of a point in base_link."""
    if abs(x) >= abs(y):
        return "front" if x > 0 else "rear"
    return "left" if y > 0 else "right"
