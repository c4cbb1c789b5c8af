"""Announcements by radio: the robot's pose and next metres, and those of others."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.belief import Belief
from roboglot.model.components.logistics.traffic_radio import WAY_MAX, Announcement, TrafficRadio
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot

HEARD_MAX = 1.0  # s for which an announcement counts
HEARD_REACH = 12.0  # m within which announcements matter
PERIOD = 0.2  # s between two announcements
AROUND = 0.1  # m around a hull in which echoes are its own

Body = tuple[float, float, float]  # x, y, radius


class Announcer:
    """Announces the robot's pose and ``way`` (n, 2; map, m) until ``close``; silent without a radio or a map."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot, self._belief = robot, belief
        self.way: NDArray[np.float64] = np.empty((0, 2))
        self.inside = False  # whether the robot is in a place too narrow for two robots to pass
        self._announced_at = -math.inf
        self._bodies: list[Body] = []  # of those that announce themselves
        self._watched: list[Body] = []
        self._stop = robot.events.listen(ScanTaken, self._announce)

    def close(self) -> None:
        """Stop announcing."""
        self._stop()
        if TrafficRadio in self._robot:
            self._robot[TrafficRadio].announce(None)

    @property
    def frame(self) -> str:
        """Name of the announcements' map; "" while the robot announces nothing."""
        speaks = TrafficRadio in self._robot and not self._belief.in_doubt
        return self._belief.frame if speaks else ""

    def heard(self, stamp: float) -> list[Announcement]:
        """Return others' announcements that are recent, near, and on the same map; one in doubt listens, too."""
        frame = self._belief.frame
        if not frame or TrafficRadio not in self._robot:
            return []
        here = self._belief.pose
        return [
            other
            for other in self._robot[TrafficRadio].heard()
            if other.frame == frame and stamp - other.stamp <= HEARD_MAX and other.pose.distance_to(here) <= HEARD_REACH
        ]

    def announcement(self, stamp: float) -> Announcement:
        """Return the robot's current announcement."""
        robot, belief = self._robot, self._belief
        return Announcement(
            robot=robot.id,
            frame=self.frame,
            stamp=stamp,
            pose=belief.pose,
            speed=belief.odometry.reading.twist.speed,
            radius=robot.description.radius,
            priority=robot[TrafficRadio].priority,
            way=tuple(Point(x, y) for x, y in self.way[:WAY_MAX].tolist()),
            inside=self.inside,
        )

    def watch(self, movers: Iterable[tuple[float, float, float, float]]) -> None:
        """Keep others that announce nothing off the map, too: x, y, radius (m) and speed (m/s) of each."""
        self._watched = [(x, y, radius + AROUND + PERIOD * speed) for x, y, radius, speed in movers]
        self._belief.others = [*self._bodies, *self._watched]

    def _announce(self, event: ScanTaken) -> None:
        if event.stamp - self._announced_at < PERIOD - 0.01 or TrafficRadio not in self._robot:
            return
        self._announced_at = event.stamp
        self._bodies = [
            (other.pose.x, other.pose.y, other.radius + AROUND + PERIOD * other.speed)
            for other in self.heard(event.stamp)
        ]
        self._belief.others = [*self._bodies, *self._watched]
        self._robot[TrafficRadio].announce(self.announcement(event.stamp) if self.frame else None)
