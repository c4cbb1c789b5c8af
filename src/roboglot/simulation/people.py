"""People who walk their paths and stop when a robot is right in front of them. Knows no physics, only places."""

from __future__ import annotations

import math
from collections.abc import Iterable

from roboglot.model.geometry import Point, Pose
from roboglot.simulation.description import Person

MANNERS = 0.8  # m to a robot ahead at which people wait
SIDE = 0.55  # m to the side at which they still pass it


class Walker:
    """One person on the way."""

    def __init__(self, person: Person, floor: int) -> None:
        self.person, self.floor = person, floor
        self._path = [Point(*spot) for spot in person.path]
        self._next = 1 % len(self._path)
        self._direction = 1
        self._waits = person.pause
        self.walking = False
        facing = self._path[0].bearing_to(self._path[self._next]) if len(self._path) > 1 else 0.0
        self.pose = Pose(self._path[0].x, self._path[0].y, facing)

    def walk(self, seconds: float, robots: Iterable[Pose]) -> bool:
        """Go on for ``seconds``; whether the pose changed."""
        self.walking = self._walk(seconds, robots)
        return self.walking

    def _walk(self, seconds: float, robots: Iterable[Pose]) -> bool:
        if len(self._path) == 1:
            return False
        if self._waits > 0.0:
            self._waits -= seconds
            return False
        goal, pose = self._path[self._next], self.pose
        heading = pose.point.bearing_to(goal)
        if any(self._minds(robot, heading) for robot in robots):
            return False
        step, left = self.person.speed * seconds, pose.distance_to(goal)
        if left <= step:
            self.pose = Pose(goal.x, goal.y, heading)
            self._arrive()
        else:
            self.pose = Pose(pose.x + step * math.cos(heading), pose.y + step * math.sin(heading), heading)
        return True

    def _minds(self, robot: Pose, heading: float) -> bool:
        """Whether ``robot`` is close and in the way."""
        seen = robot.relative_to(Pose(self.pose.x, self.pose.y, heading))
        return 0.0 < seen.x < MANNERS and abs(seen.y) < SIDE

    def _arrive(self) -> None:
        self._waits = self.person.pause
        if not 0 <= self._next + self._direction < len(self._path):
            self._direction = -self._direction
        self._next += self._direction
