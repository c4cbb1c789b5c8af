"""The map's laser landmarks: adds strips seen often, updates moved ones, and localizes the robot by them."""

from __future__ import annotations

import asyncio
import uuid
from dataclasses import replace

from roboglot.autonomy.landmarks.finder import pose_by_landmarks
from roboglot.autonomy.landmarks.pose_update import pose_fixed
from roboglot.autonomy.slam.belief import Belief
from roboglot.model.components.mapping.annotations import MARKS_MAX, Annotations, MapAnnotations
from roboglot.model.components.mapping.laser_landmarks import LaserLandmarks
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.sensing.reflectors import Reflectors
from roboglot.model.components.system.settings import Settings
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.values import dataclass

KEY = "laser_landmarks.updating"
SURE = 0.5  # quality of localization from which strips are placed
LOST_QUALITY, LOST_SECONDS = 0.2, 3.0  # quality below which to search for known landmarks, after these s
TURNING_MAX = 0.4  # rad/s beyond which directions are vague
SIGHTINGS = 12  # at one place before it becomes a landmark
NEAR = 0.3  # m between two sightings of one strip
MOVED = 0.06  # m of displacement after which a landmark is moved
CANDIDATES_MAX = 200
NAMES = uuid.UUID("0f3fd5f1-7d62-4c6b-9a55-6a9c0c1a40ce")  # the name space of landmark ids


@dataclass(slots=True)
class _Candidate:
    place: Point
    sightings: int = 0

    def see(self, place: Point) -> None:
        self.sightings = min(SIGHTINGS, self.sightings + 1)
        share = 1.0 / self.sightings
        self.place = Point(
            self.place.x + share * (place.x - self.place.x), self.place.y + share * (place.y - self.place.y)
        )


class LandmarkKeeper(LaserLandmarks):
    """Landmarks that are updated and used at every scan."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot, self._belief = robot, belief
        self._candidates: list[_Candidate] = []
        self._unsaved = True  # only for a robot without settings
        self._lost_since: float | None = None
        self._writing: asyncio.Task[None] | None = None
        self._viewer = robot[Reflectors].detector.subscribe()
        self._stop = robot.events.listen(ScanTaken, self._look)

    def close(self) -> None:
        """Stop detecting."""
        self._stop()
        self._viewer.close()
        if self._writing is not None:
            self._writing.cancel()

    @property
    def updating(self) -> bool:
        return bool(self._robot[Settings].get(KEY, True)) if Settings in self._robot else self._unsaved

    async def set_updating(self, on: bool) -> None:
        self._unsaved = on
        if Settings in self._robot:
            await self._robot[Settings].put(KEY, on)

    def _look(self, event: ScanTaken) -> None:
        seen = self._robot[Reflectors].detector.latest
        if seen is None or seen.stamp != event.stamp or not seen.seen:
            return
        places = [strip.place for strip in seen.seen]
        known = [mark.pose.point for mark in self._robot[MapAnnotations].current.landmarks]
        if self._lost(event.stamp):
            if (pose := pose_by_landmarks(places, known)) is not None:
                self._lost_since = None
                self._robot[Localization].set_pose(pose)
        elif self._belief.quality >= SURE and abs(self._belief.odometry.reading.twist.yaw) < TURNING_MAX:
            if self._belief.localizing and known:
                self._fix(places, known, event.odometry)
            here = self._belief.pose
            if self.updating:
                self._remember([here.compose(Pose(place.x, place.y)).point for place in places])

    def _fix(self, places: list[Point], known: list[Point], odometry: Pose) -> None:
        """Correct the pose at the scan by landmarks, weighted by the belief's doubt."""
        belief = self._belief
        pose, doubt = pose_fixed(belief.map_to_odom.compose(odometry), belief.doubt, places, known)
        if doubt is not belief.doubt:  # else no strip is in sight that matches a landmark
            belief.doubt = belief.covariance = doubt
            belief.move_to(pose, odometry)

    def _lost(self, now: float) -> bool:
        if not self._belief.localizing or self._belief.quality >= LOST_QUALITY:
            self._lost_since = None
            return False
        self._lost_since = now if self._lost_since is None else self._lost_since
        return now - self._lost_since >= LOST_SECONDS

    def _remember(self, places: list[Point]) -> None:
        for place in places:
            near = [each for each in self._candidates if each.place.distance_to(place) < NEAR]
            if near:
                min(near, key=lambda each: each.place.distance_to(place)).see(place)
            elif len(self._candidates) < CANDIDATES_MAX:
                self._candidates.append(_Candidate(place, 1))
        annotations = self._robot[MapAnnotations].current
        if (self._writing is None or self._writing.done()) and self._edit(annotations) is not annotations:
            self._writing = asyncio.ensure_future(self._robot[MapAnnotations].change(self._edit))

    def _edit(self, now: Annotations) -> Annotations:
        """Add landmarks that are certain and not on the map yet."""
        marks = list(now.landmarks)
        for candidate in self._candidates:
            if candidate.sightings < SIGHTINGS:
                continue
            place = candidate.place
            nearest = min(marks, key=lambda mark: mark.pose.point.distance_to(place), default=None)
            away = nearest.pose.point.distance_to(place) if nearest else NEAR
            if nearest is not None and away < NEAR:
                if away > MOVED:
                    marks[marks.index(nearest)] = replace(nearest, pose=Pose(place.x, place.y))
            elif len(marks) < MARKS_MAX:
                name = uuid.uuid5(NAMES, f"{self._robot.id} {place.x:.3f} {place.y:.3f}")
                marks.append(PointOfInterest(str(name), Pose(place.x, place.y), {"found": "true"}))
        return now if marks == list(now.landmarks) else replace(now, landmarks=tuple(marks))
