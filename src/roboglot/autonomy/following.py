"""Following a person whom the camera sees: turns towards them, keeps its place beside them, stops before obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roboglot.autonomy.base_actions import PERIOD, start_on_base
from roboglot.autonomy.scan_points import ScanReader
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.base import Base
from roboglot.model.components.following import Following, FollowSide
from roboglot.model.components.lidar import Lidar
from roboglot.model.components.odometry import Odometry
from roboglot.model.components.vision import Vision
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import STILL, Point, Pose, Twist
from roboglot.model.perception import PersonSeen, Sighting
from roboglot.model.robot import Robot

DISTANCE_MIN, DISTANCE_MAX = 0.5, 5.0  # m
OUT_OF_SIGHT = 0.6  # s after which it stops and looks where the person was last
LOST = 15.0  # s after which it gives up
SPEED, TURN_RATE = 1.0, 1.5  # m/s, rad/s at most
GAIN, TURN_GAIN = 1.2, 2.5  # 1/s
CLOSE = 0.08  # m from its place within which it stands
BESIDE = math.radians(130.0)  # from where the person walks, at which its place beside them is: a little behind
STRIDE = 0.3  # m after which a person's direction is taken anew
GAP, BRAKING = 0.15, 0.8  # m kept before the hull; m/s2 to brake with


@dataclass(slots=True)
class _Quarry:
    """Who is followed, and where they were seen last (odom frame, m; robot time)."""

    number: int | None
    place: Point | None = None
    seen_at: float = 0.0
    course: float = 0.0  # rad in odom: where they walk, or as seen from the robot at first
    _anchor: Point | None = None

    def spot(self, place: Point, stamp: float, seen_from: Pose) -> None:
        """They are at ``place`` now."""
        if self._anchor is None:
            self._anchor, self.course = place, seen_from.point.bearing_to(place)
        elif self._anchor.distance_to(place) > STRIDE:
            self._anchor, self.course = place, self._anchor.bearing_to(place)
        self.place, self.seen_at = place, stamp


class SightFollowing(Following):
    """Keeps facing the person, because the camera does not turn."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._reader = ScanReader()

    def follow(
        self,
        person: int | None = None,
        *,
        side: FollowSide = FollowSide.BEHIND,
        distance: float = 1.0,
        source: str = "",
        on_busy: OnBusy = OnBusy.REPLACE,
    ) -> Action:
        if not DISTANCE_MIN <= distance <= DISTANCE_MAX:
            raise InvalidGoal(f"people are followed at {DISTANCE_MIN} to {DISTANCE_MAX} m, not {distance}")

        async def run(action: Action) -> None:
            await self._run(action, _Quarry(person, seen_at=self._robot.clock.time()), side, distance)

        goal = (person, side, distance)
        return start_on_base(self._robot, "follow", run, goal=goal, source=source, on_busy=on_busy)

    async def _run(self, action: Action, quarry: _Quarry, side: FollowSide, distance: float) -> None:
        robot, base = self._robot, self._robot[Base]
        with robot[Vision].people.subscribe() as viewer:
            while True:
                if await action.hold(lambda: base.set_velocity(STILL)):
                    quarry.seen_at = robot.clock.time()
                for sighting in viewer.drain():
                    self._spot(quarry, sighting)
                age = robot.clock.time() - quarry.seen_at
                if age > LOST:
                    raise NotFound(f"nobody to follow was seen for {LOST:g} s")
                if quarry.place is None or age > OUT_OF_SIGHT:
                    action.report("searching")
                    base.set_velocity(self._look_for(quarry))
                else:
                    twist, free = self._keep(quarry, side, distance)
                    action.report("following" if free else "waiting")
                    base.set_velocity(twist)
                await robot.clock.sleep(PERIOD)

    def _spot(self, quarry: _Quarry, sighting: Sighting[PersonSeen]) -> None:
        for person in sighting.seen:
            if quarry.number in (None, person.number):
                quarry.number = person.number
                seen_from = self._robot[Odometry].reading.pose
                place = seen_from.compose(Pose(person.place.x, person.place.y)).point
                quarry.spot(place, sighting.stamp, seen_from)
                return

    def _look_for(self, quarry: _Quarry) -> Twist:
        """Turn towards where the person was seen last; nowhere else, without a hint."""
        if quarry.place is None:
            return STILL
        here = self._robot[Odometry].reading.pose
        bearing = math.remainder(here.point.bearing_to(quarry.place) - here.yaw, math.tau)
        return Twist(yaw=_within(TURN_RATE, TURN_GAIN * bearing))

    def _keep(self, quarry: _Quarry, side: FollowSide, distance: float) -> tuple[Twist, bool]:
        """The velocity to its place near the person, and whether nothing is in the way."""
        assert quarry.place is not None
        here, holonomic = self._robot[Odometry].reading.pose, self._robot[Base].limits.holonomic
        bearing = math.remainder(here.point.bearing_to(quarry.place) - here.yaw, math.tau)
        if side is FollowSide.BEHIND:
            out = here.point.bearing_to(quarry.place) + math.pi
        else:
            out = quarry.course + (BESIDE if side is FollowSide.LEFT else -BESIDE)
        goal = Pose(quarry.place.x + distance * math.cos(out), quarry.place.y + distance * math.sin(out))
        x, y = (goal.relative_to(here).x, goal.relative_to(here).y)
        left = math.hypot(x, y)
        turn = _within(TURN_RATE, TURN_GAIN * bearing)
        if left < CLOSE:
            return Twist(yaw=turn), True
        if not holonomic:
            turn, y = _within(TURN_RATE, TURN_GAIN * math.atan2(y, x) if x > 0.0 else turn), 0.0
            left = abs(x)
        room = self._room(math.atan2(y, x))
        speed = min(SPEED, GAIN * left, math.sqrt(2.0 * BRAKING * max(0.0, room - GAP)))
        scale = speed / max(left, 1e-6)
        return Twist(scale * x, scale * y, turn), room > GAP

    def _room(self, bearing: float) -> float:
        """Metres that the hull can move that way before what the lidar sees."""
        scan, radius = self._robot[Lidar].scan, self._robot.description.radius
        if scan is None:
            return 0.0
        points = self._reader.read(scan).points
        along = points @ np.array([math.cos(bearing), math.sin(bearing)])
        beside = np.abs(points @ np.array([-math.sin(bearing), math.cos(bearing)]))
        ahead = along[(beside < radius) & (along > 0.0)]
        return float(ahead.min()) - radius if len(ahead) else math.inf


def _within(limit: float, value: float) -> float:
    return max(-limit, min(limit, value))
