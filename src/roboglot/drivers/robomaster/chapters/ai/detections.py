"""Converts an EP's detections to the model's values. Distances follow from the boxes and assumed object sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from roboglot.model.components.sensing.camera import Camera
from roboglot.model.geometry import Point
from roboglot.model.perception import (
    Box,
    Colour,
    Gesture,
    GestureSeen,
    LinePoint,
    LineSeen,
    MarkerSeen,
    PersonSeen,
    RobotSeen,
)
from roboglot.wire.robomaster.telemetry import LinePoint as WirePoint
from roboglot.wire.robomaster.telemetry import Target

GESTURES = {4: Gesture.V, 5: Gesture.V_DOWN, 6: Gesture.PHOTO}
MARKERS = (
    {1: "stop", 4: "left", 5: "right", 6: "forward", 7: "backward", 8: "heart"}
    | {10 + digit: str(digit) for digit in range(10)}
    | {20 + letter: chr(65 + letter) for letter in range(26)}
)
PERSON, ACROSS = 1.72, 0.6  # m: height; width with arms, used when head or feet are cut off
MARKER, ROBOT = 0.17, 0.27  # m: height
EDGE = 0.01  # of the picture
SAME = 0.25  # of the picture between two boxes that belong to one person


class Locator:
    """Locates objects in base_link by their boxes in the picture of ``camera``."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera

    def distance(self, box: Box, height: float, width: float = 0.0) -> float:
        """Return the distance from the lens in m; uses ``width`` if the box is cut off above or below."""
        across = 2 * math.tan(self._camera.fov / 2)  # the picture's width at a distance of one metre
        if width and (box.y - box.height / 2 < EDGE or box.y + box.height / 2 > 1 - EDGE):
            return width / max(box.width * across, 1e-3)
        return height / max(box.height * across * self._camera.height / self._camera.width, 1e-3)

    def place(self, box: Box, distance: float) -> Point:
        """Return the position in base_link."""
        mount = self._camera.mount
        yaw = mount.yaw + math.atan((0.5 - box.x) * 2 * math.tan(self._camera.fov / 2))
        return Point(mount.x + distance * math.cos(yaw), mount.y + distance * math.sin(yaw))

    def person(self, target: Target, number: int) -> PersonSeen:
        """Return a person, assumed to stand."""
        box = box_of(target)
        distance = self.distance(box, PERSON, ACROSS)
        return PersonSeen(box, number, distance, self.place(box, distance))

    def robot(self, target: Target) -> RobotSeen:
        """Return another EP."""
        box = box_of(target)
        distance = self.distance(box, ROBOT)
        return RobotSeen(box, distance, self.place(box, distance))

    def marker(self, target: Target, colour: Colour) -> MarkerSeen | None:
        """Return one of the maker's marker cards, or None for an unknown symbol."""
        box, symbol = box_of(target), MARKERS.get(target.info or 0)
        return (symbol and MarkerSeen(symbol, colour, box, self.distance(box, MARKER))) or None


class PersonTracker:
    """Numbers people; a box close to one of the previous picture keeps its number."""

    def __init__(self) -> None:
        self._last: dict[int, Box] = {}
        self._next = 1

    def number(self, boxes: Sequence[Box]) -> list[int]:
        """Return one number for each box, in order."""
        left, now = dict(self._last), dict[int, Box]()
        for box in boxes:
            number = min(left, key=lambda known: _apart(left[known], box), default=0)
            if not number or _apart(left[number], box) > SAME:
                number, self._next = self._next, self._next + 1
            left.pop(number, None)
            now[number] = box
        self._last = now
        return list(now)


def _apart(one: Box, other: Box) -> float:
    return math.hypot(one.x - other.x, one.y - other.y)


def box_of(target: Target) -> Box:
    """Return the box; both sides count from the upper left corner, in fractions of the picture."""
    return Box(target.x, target.y, target.width, target.height)


def gesture_of(target: Target, number: int) -> GestureSeen | None:
    """Return the gesture, or None for an undocumented number."""
    gesture = GESTURES.get(target.info or 0)
    return (gesture and GestureSeen(box_of(target), gesture, number)) or None


def line_of(points: Sequence[WirePoint], colour: Colour) -> LineSeen:
    """Return a line. The curvature gets the sign in which its direction turns (model: left positive)."""
    turns = points[-1].tangent - points[0].tangent
    sign = -1.0 if turns > 0 else 1.0
    return LineSeen(
        colour, tuple(LinePoint(p.x, p.y, math.radians(p.tangent), sign * abs(p.curvature)) for p in points)
    )
