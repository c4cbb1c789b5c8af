"""Tracks a mark while the robot moves, in the odometry's frame, by the sense for this kind of mark."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import AsyncIterator
from contextlib import AbstractContextManager, asynccontextmanager, nullcontext
from typing import NamedTuple

from roboglot.autonomy.docking.mark_finder import between_strips, find_board, find_shelf
from roboglot.autonomy.navigation.base_actions import PERIOD
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.model.components.motion.tag_docking import Mark, MarkGoal
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.reflectors import Reflectors
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot

LOOK_SECONDS = 4.0  # to search for a mark
LOOKS = 5  # sightings averaged
FRESH = 0.35  # the weight of a new sighting while moving
LEAP = 0.25  # m from the estimate: another object
TRAIL = 100  # poses remembered, for sightings that arrive late
SENSES: dict[Mark, type[Vision | Reflectors | Lidar]] = {
    Mark.PRINTED: Vision,
    Mark.REFLECTORS: Reflectors,
    Mark.BOARD: Lidar,
    Mark.SHELF: Lidar,
}


class Sighting(NamedTuple):
    """A mark's pose in base_link at ``stamp``, s."""

    stamp: float
    pose: Pose


class MarkWatch:
    """Tracked mark. ``place``: pose in odom, +x out of its front; ``reach``: m from a shelf's middle to its front."""

    def __init__(self, robot: Robot, goal: MarkGoal) -> None:
        self._robot, self._goal = robot, goal
        self._reader = ScanReader()
        self._trail: deque[tuple[float, Pose]] = deque(maxlen=TRAIL)
        self._seen_at = -math.inf
        self.place: Pose | None = None
        self.reach = 0.0

    @asynccontextmanager
    async def open(self) -> AsyncIterator[None]:
        """Subscribe to the sense while inside the block."""
        with self._viewer():
            yield

    async def find(self) -> Pose:
        """Return the mark's pose in odom, averaged while the robot stands. Raises NotFound."""
        clock = self._robot.clock
        deadline, found = clock.time() + LOOK_SECONDS, list[Pose]()
        self._seen_at = clock.time()
        while len(found) < LOOKS and clock.time() < deadline:
            await clock.sleep(PERIOD)
            if (seen := self._look()) is not None:
                found.append(seen)
        if not found:
            raise NotFound(f"the mark ({self._goal.mark}) was not found")
        first = found[0]
        near = [seen for seen in found if seen.distance_to(first) < LEAP]
        turn = sum(wrap_angle(seen.yaw - first.yaw) for seen in near) / len(near)
        self.place = Pose(
            sum(seen.x for seen in near) / len(near),
            sum(seen.y for seen in near) / len(near),
            wrap_angle(first.yaw + turn),
        )
        return self.place

    def glance(self) -> None:
        """Correct the mark's pose by a new sighting, if there is one, while moving."""
        seen, place = self._look(), self.place
        if seen is None or place is None or seen.distance_to(place) > LEAP:
            return
        self.place = Pose(
            place.x + FRESH * (seen.x - place.x),
            place.y + FRESH * (seen.y - place.y),
            wrap_angle(place.yaw + FRESH * wrap_angle(seen.yaw - place.yaw)),
        )

    def _viewer(self) -> AbstractContextManager[object]:
        match self._goal.mark:
            case Mark.PRINTED:
                return self._robot[Vision].tags.subscribe()
            case Mark.REFLECTORS:
                return self._robot[Reflectors].detector.subscribe()
            case _:
                return nullcontext()

    def _look(self) -> Pose | None:
        """Return a new sighting, in odom; None: there is none."""
        reading = self._robot[Odometry].reading
        self._trail.append((reading.stamp, reading.pose))
        sighting = self._sighting()
        if sighting is None or sighting.stamp <= self._seen_at:
            return None
        self._seen_at = stamp = sighting.stamp
        _, here = min(self._trail, key=lambda step: abs(step[0] - stamp))
        return here.compose(sighting.pose)

    def _sighting(self) -> Sighting | None:
        """Return the newest sighting; None if there is none."""
        match self._goal.mark:
            case Mark.PRINTED:
                return self._printed()
            case Mark.REFLECTORS:
                return self._reflectors()
        scan = self._robot[Lidar].scan
        if scan is None:
            return None
        points = self._reader.read(scan).points
        if self._goal.mark is Mark.BOARD:
            board = find_board(points)
            return None if board is None else Sighting(scan.stamp, board)
        shelf = find_shelf(points)
        if shelf is None:
            return None
        pose, self.reach = shelf
        return Sighting(scan.stamp, pose)

    def _printed(self) -> Sighting | None:
        tags, texts = self._robot[Vision].tags.latest, self._goal.texts
        seen = [tag for tag in tags.seen if not texts or tag.text in texts] if tags else []
        return Sighting(tags.stamp, seen[0].pose) if tags and seen else None

    def _reflectors(self) -> Sighting | None:
        strips, wanted = self._robot[Reflectors].detector.latest, self._goal.strips
        ahead = [strip for strip in strips.seen if strip.place.x > 0.0] if strips else []
        if strips is None or len(ahead) < wanted:
            return None
        return Sighting(strips.stamp, between_strips(tuple(ahead[:wanted])))
