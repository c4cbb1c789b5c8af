"""Restricted areas: robots count each other by radio, and wait before an area that is full.

Areas with the same number and size are the same area for two robots, as on a common map.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from collections.abc import Set as AbstractSet

from roboglot.autonomy.slam.belief import Belief
from roboglot.model.actions import Action
from roboglot.model.components.logistics.traffic_radio import TrafficRadio
from roboglot.model.components.mapping.annotations import Area, AreaKind, MapAnnotations
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot

BRAKING, REACTION, MARGIN = 0.5, 0.3, 0.25  # m/s2, s, m: for the distance at which an area counts as entered
SOON = 5.0  # s within which a claimed area is entered or released
AREA = "area "  # begins the name of an area in claims
STEP = 0.1  # m between the places ahead that are checked
MANUAL = frozenset({"drive", "move by"})  # manual driving is not held up


class RestrictedAreas:
    """Watch over restricted areas at every scan, which pauses the driving action before a full one."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot, self._belief = robot, belief
        self._held: tuple[Action, str] | None = None
        self._entering: dict[str, float] = {}  # until when a claim holds for an area about to be entered
        self._stop = robot.events.listen(ScanTaken, self._look)

    def close(self) -> None:
        """Stop watching, and release the areas."""
        self._stop()
        self._robot[TrafficRadio].claim(())

    def _look(self, event: ScanTaken) -> None:
        radio, drawn = self._robot[TrafficRadio], self._robot[MapAnnotations].current
        if not drawn.areas and not radio.claims and self._held is None:
            return  # most maps have none
        areas = {_name(area): area for area in drawn.areas_of(AreaKind.RESTRICTED) if area.robots_max}
        full = self._enter(areas, event.stamp)
        if self._held is not None:
            self._wait(areas, event.stamp)
        elif full is not None:
            self._hold(full)
        claims = self._claims(areas, event.stamp)
        if claims != radio.claims:
            radio.claim(claims)

    def _enter(self, areas: Mapping[str, Area], now: float) -> str | None:
        """Claim the areas ahead that have room; return the name of one that has none."""
        radio, ahead = self._robot[TrafficRadio], self._ahead()
        full: str | None = None
        for name, area in areas.items():
            if not any(area.contains(place) for place in ahead):
                continue
            if name in radio.claims or radio.others(name) < (area.robots_max or 0):
                self._entering[name] = now + SOON
            else:
                full = name
        return full

    def _claims(self, areas: Mapping[str, Area], now: float) -> AbstractSet[str]:
        """Return the areas that the robot is in or about to enter, and what else it claims."""
        pose, radius = self._belief.pose, self._robot.description.radius
        inside = {name for name, area in areas.items() if _touches(area, pose, radius)}
        entering = self._entering.items()
        self._entering = {name: until for name, until in entering if until > now and name not in inside}
        claimed = self._robot[TrafficRadio].claims
        others = {name for name in claimed if not name.startswith(AREA)}  # such as a ticket for the lift
        return inside | self._entering.keys() | others

    def _hold(self, name: str) -> None:
        """Pause the driving action, unless it is manual or paused already."""
        for action in self._robot.actions.running(BASE):
            if action.name not in MANUAL and action.pausable and not action.paused:
                action.pause()
                self._held = action, name

    def _wait(self, areas: Mapping[str, Area], now: float) -> None:
        """Claim the area as soon as there is room, and resume the action."""
        assert self._held is not None
        action, name = self._held
        area = areas.get(name)
        if action.status.ended or not action.paused:
            self._held = None
        elif area is None or self._robot[TrafficRadio].others(name) < (area.robots_max or 0):
            self._held = None
            self._entering[name] = now + SOON
            action.resume()

    def _ahead(self) -> list[Pose]:
        """Return the poses within the stopping distance (map)."""
        velocity, pose = self._robot[Base].velocity, self._belief.pose
        speed = velocity.speed
        if speed < 0.02:
            return []
        reach = self._robot.description.radius + MARGIN + speed * REACTION + speed**2 / (2.0 * BRAKING)
        ways = [STEP * step for step in range(1, math.ceil(reach / STEP) + 1)]
        return [pose.compose(Pose(way * velocity.x / speed, way * velocity.y / speed)) for way in ways]


def _name(area: Area) -> str:
    return f"{AREA}{area.id}:{area.start.distance_to(area.end):.2f}x{area.half_width:.2f}"


def _touches(area: Area, pose: Pose, radius: float) -> bool:
    """True if the hull reaches into the area."""
    around = [pose.compose(Pose(radius * math.cos(a), radius * math.sin(a))) for a in (0.0, 1.57, 3.14, -1.57)]
    return any(area.contains(place) for place in (pose, *around))
