"""The AI chapter: recognition in the camera's pictures, pushed at its own rate (manual 3.2.15)."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence, Set
from typing import Any

from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import InvalidGoal, Refused, RobotError
from roboglot.model.feed import Viewer
from roboglot.model.perception import Box, GestureSeen, LineSeen, MarkerSeen, PersonSeen, RobotSeen, Sighting
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.limits import TARGETS_MAX
from roboglot.protocols.robomaster.ranges import LineColour, MarkerColour, MarkerDistance, OnOff
from roboglot.protocols.robomaster.switching import switch_or_undo
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.vocabulary import GESTURES, MARKERS
from roboglot.wire.robomaster.replies import Number

Numbers = tuple[Number, ...]
ROBOTS_NAMES = {"person": "people", "gesture": "pose"}
GROUPS = (("person", "gesture", "marker", "robot"), ("line",))  # at most one of each
CURVATURE_MAX = 10.0
LOOKING = 0.04  # s between two checks for detections; detectors are slower


class Ai:
    """Kinds of recognition that are pushed, and their filters."""

    def __init__(self, context: Context) -> None:
        self._context, self._robot = context, context.robot
        self._open: dict[str, Viewer[Sighting[object]]] = {}
        self._reported: dict[str, float] = {}
        self._task: asyncio.Task[None] | None = None
        self.line_colour: str | None = None  # None: any
        self.marker_colour = "red"
        self.marker_distance = 0.0  # m; closer markers do not count

    def switch(self, wanted: dict[str, bool]) -> None:
        """Switch kinds, all or nothing. Raises Refused for two of a group, ComponentMissing without vision."""
        after = {name for name in WORDED if wanted.get(name, name in self._open)}
        for group in GROUPS:
            if len(rivals := [name for name in group if name in after]) > 1:
                raise Refused(f"{' and '.join(rivals)} exclude each other; switch one off")
        before = self.kinds
        try:
            self._watch(after)
        except RobotError:
            self._watch(before)
            raise
        if self._open and self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._push(), name="push AI")
        elif not self._open:
            self.reset()

    @property
    def kinds(self) -> frozenset[str]:
        """Kinds that are on."""
        return frozenset(self._open)

    def _watch(self, kinds: Set[str]) -> None:
        """Watch for these kinds, and no others; those that are over end first, as they may exclude new ones."""
        vision = self._robot[Vision]
        for name in self.kinds - kinds:
            self._open.pop(name).close()
        for name in kinds - self.kinds:
            self._open[name] = _detector(vision, name).subscribe()

    def reset(self) -> None:
        """Switch everything off; colours and distance stay until the session ends."""
        if self._task:
            self._task.cancel()
            self._task = None
        for viewer in self._open.values():
            viewer.close()
        self._open.clear()

    async def _push(self) -> None:
        vision, profile = self._robot[Vision], self._context.profile
        async for _ in self._robot.clock.every(LOOKING):
            attributes: list[tuple[str, Numbers]] = []
            for name in tuple(self._open):
                sighting = _detector(vision, name).latest
                if sighting is not None and self._reported.get(name) != sighting.stamp:
                    self._reported[name] = sighting.stamp
                    word = ROBOTS_NAMES.get(name, name) if profile.as_robots else name
                    attributes.append((word, self._numbers(name, sighting.seen)))
            if profile.as_robots and attributes:  # in one datagram, without `;` between the kinds
                self._context.send(profile.push("AI", *attributes, separator=" "))
            elif attributes:
                for attribute in attributes:
                    self._context.send(profile.push("AI", attribute))

    def _numbers(self, name: str, seen: Sequence[object]) -> Numbers:
        """Return the count, then the numbers of each."""
        targets = [target for target in (WORDED[name](self, each) for each in seen) if target is not None]
        kept = targets[:TARGETS_MAX]
        return (len(kept), *(number for target in kept for number in target))

    def gesture(self, seen: GestureSeen) -> Numbers | None:
        """Return the numbers of a gesture; None for those without."""
        info = GESTURES.get(seen.gesture)
        return None if info is None else (info, *_box(seen.box))

    def marker(self, seen: MarkerSeen) -> Numbers | None:
        """Return the numbers of a marker; None if filtered out by colour or distance."""
        info = MARKERS.get(seen.symbol)
        if info is None or seen.colour != self.marker_colour or seen.distance < self.marker_distance:
            return None
        return (info, *_box(seen.box))

    def line(self, seen: LineSeen) -> Numbers | None:
        """Return ten points of x, y, tangent in degrees, curvature 0 to 10."""
        if self.line_colour not in (None, seen.colour):
            return None
        return tuple(
            number
            for point in seen.points
            for number in (point.x, point.y, math.degrees(point.angle), min(CURVATURE_MAX, abs(point.curvature)))
        )

    def target(self, seen: PersonSeen | RobotSeen) -> Numbers | None:
        """Return where it is."""
        return _box(seen.box)


WORDED: dict[str, Callable[[Ai, Any], Numbers | None]] = {
    "person": Ai.target,
    "robot": Ai.target,
    "gesture": Ai.gesture,
    "marker": Ai.marker,
    "line": Ai.line,
}


def _box(box: Box) -> Numbers:
    return float(box.x), float(box.y), float(box.width), float(box.height)


def _detector(vision: Vision, name: str) -> Detector[object]:
    detectors: dict[str, Detector[Any]] = {
        "person": vision.people,
        "gesture": vision.gestures,
        "marker": vision.markers,
        "line": vision.lines,
        "robot": vision.robots,
    }
    return detectors[name]


@TABLE.on("AI attribute", right=Right.SEE, needs=(Vision,))
def set_attribute(
    context: Context,
    *,
    line_color: LineColour | None = None,
    marker_color: MarkerColour | None = None,
    marker_dist: MarkerDistance | None = None,
) -> None:
    """Filter lines and markers by colour, and markers by distance, m (3.2.15.1)."""
    context.robot.require(Vision)
    ai = context.part(Ai)
    ai.line_colour = line_color or ai.line_colour
    ai.marker_colour = marker_color or ai.marker_colour
    ai.marker_distance = marker_dist or ai.marker_distance


@TABLE.on("AI push", right=Right.SEE, needs=(Vision,))
async def push(
    context: Context,
    *,
    person: OnOff | None = None,
    people: OnOff | None = None,
    gesture: OnOff | None = None,
    pose: OnOff | None = None,
    marker: OnOff | None = None,
    robot: OnOff | None = None,
    line: OnOff | None = None,
) -> None:
    """Switch kinds on and off: one of person, gesture, marker, robot, and line beside it (3.2.15.2).

    people and pose are real robots' words for person and gesture. All or nothing, as some exclude each other.
    """
    words = {"person": person or people, "gesture": gesture or pose, "marker": marker, "robot": robot, "line": line}
    if {person, people} == {"on", "off"} or {gesture, pose} == {"on", "off"}:
        raise InvalidGoal("the same attribute is on and off")
    context.robot.require(Vision)
    ai = context.part(Ai)
    before = {name: name in ai.kinds for name in WORDED}
    wanted = {name: word == "on" for name, word in words.items() if word}
    await switch_or_undo(lambda: ai.switch(wanted), lambda: ai.switch(before))
