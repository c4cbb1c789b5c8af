"""Following a person by camera or radio tag, or a thing by lidar, around obstacles."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field

from roboglot.autonomy.following.thing_finder import moved_thing, thing_at
from roboglot.autonomy.following.trail import Points, Trail, gap, room
from roboglot.autonomy.navigation.base_actions import PERIOD, start_on_base
from roboglot.autonomy.slam.scan_points import ScanReader, sees
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.following import Following, FollowSide, check_distance
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.ultra_wideband import TagReading, UltraWideband
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import NotFound
from roboglot.model.geometry import STILL, Point, Pose, Twist, bounded
from roboglot.model.perception import PersonSeen, Sighting
from roboglot.model.robot import Robot
from roboglot.model.sensing import LaserScan
from roboglot.values import dataclass

OUT_OF_SIGHT = 0.6  # s after which the robot stops and searches where the person was last seen
GIVE_UP_AFTER = 15.0  # s without sight of the person
SPEED, TURN_RATE = 1.0, 1.5  # m/s, rad/s at most
GAIN, TURN_GAIN = 1.2, 2.5  # 1/s
AHEAD = 1.0  # m of free room straight ahead that suffice for the moment
ROUND_THE_CORNER = 0.3  # m from the last sighting at which the robot turns to where the person went
TOO_NEAR = 1.8  # m within which a person may stand unrecognized
UNSEEN = 0.3  # s without sight of a person after which the lidar tracks one who is TOO_NEAR
BY_LIDAR_MAX = 15.0  # s for which the lidar alone may do so; after that, the camera has to see the person again
BACK, BACK_BEARING = 0.2, 0.5  # m/s, rad
CLOSE = 0.08  # m from its place within which the robot stands still
BESIDE = math.radians(130.0)  # from the person's course, at which the robot's place beside them lies: a little behind
STRIDE = 0.3  # m after which a person's direction is updated
TAG_FRESH = 0.35  # the weight of a new range of the tag: while in sight; a third of it otherwise
GAP, BRAKING = 0.15, 0.8  # m kept in front of the hull; m/s2 of braking


@dataclass(slots=True)
class _Followed:
    """The followed person or thing, with place (odom, m) and time (robot time, s) of the last sighting."""

    number: int | None
    place: Point | None = None
    seen_at: float = 0.0
    course: float = 0.0  # rad in odom: the person's course, at first the bearing from the robot
    trail: Trail = field(default_factory=Trail)
    around: float | None = None  # rad in odom: the direction of the current detour
    ranged_at: float = -math.inf  # robot time
    recognized_at: float = -math.inf  # robot time at which the camera saw the person last
    _anchor: Point | None = None

    def spot(self, place: Point, stamp: float, seen_from: Pose) -> None:
        """Note a sighting at ``place`` (odom), and update the course."""
        if self._anchor is None:
            self._anchor, self.course = place, seen_from.point.bearing_to(place)
        elif self._anchor.distance_to(place) > STRIDE:
            self._anchor, self.course = place, self._anchor.bearing_to(place)
        self.place, self.seen_at = place, stamp
        self.trail.add(place)


class SightFollowing(Following):
    """Following that keeps facing the person, as the camera does not turn."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._reader = ScanReader()
        self._followed: _Followed | None = None

    @property
    def place(self) -> Point | None:
        if self._followed is None or self._followed.place is None:
            return None
        place = self._followed.place
        return Pose(place.x, place.y).relative_to(self._robot[Odometry].reading.pose).point

    def follow(
        self,
        person: int | None = None,
        *,
        side: FollowSide = FollowSide.BEHIND,
        distance: float = 1.0,
        source: str = "",
    ) -> Action:
        check_distance(distance)

        vision = self._robot[Vision]

        async def run(action: Action) -> None:
            followed = _Followed(person, seen_at=self._robot.clock.time())
            with vision.people.subscribe() as viewer:

                def look() -> None:
                    for sighting in viewer.drain():
                        self._spot(followed, sighting)
                    self._see_near(followed)

                why = f"no person to follow was seen for {GIVE_UP_AFTER:g} s"
                await self._run(action, followed, look, side, distance, why)

        goal = (person, side, distance)
        return start_on_base(self._robot, "follow", run, goal=goal, source=source)

    def follow_tag(self, *, side: FollowSide = FollowSide.BEHIND, distance: float = 1.0, source: str = "") -> Action:
        check_distance(distance)
        radio = self._robot[UltraWideband]

        async def run(action: Action) -> None:
            followed = _Followed(None, seen_at=self._robot.clock.time())

            def range_it() -> None:
                if (tag := radio.tag) is not None and tag.stamp > followed.ranged_at:
                    self._range(followed, tag)

            why = f"no tag to follow was heard for {GIVE_UP_AFTER:g} s"
            await self._run(action, followed, range_it, side, distance, why)

        return start_on_base(self._robot, "follow tag", run, goal=(side, distance), source=source)

    def follow_thing(
        self, place: Point, *, side: FollowSide = FollowSide.BEHIND, distance: float = 1.0, source: str = ""
    ) -> Action:
        check_distance(distance)
        lidar = self._robot[Lidar]

        async def run(action: Action) -> None:
            here = self._robot[Odometry].reading.pose
            thing = thing_at(self._reader.read(lidar.scan).points, place) if lidar.scan else None
            if thing is None:
                raise NotFound("there is no thing to follow")
            followed = _Followed(None)
            followed.spot(here.compose(Pose(thing.x, thing.y)).point, self._robot.clock.time(), here)
            why = f"the thing to follow was not seen for {GIVE_UP_AFTER:g} s"
            await self._run(action, followed, lambda: self._see(followed, lidar.scan), side, distance, why)

        goal = (place, side, distance)
        return start_on_base(self._robot, "follow thing", run, goal=goal, source=source)

    def _see_near(self, followed: _Followed) -> None:
        """Track a person who is too near for the camera by the lidar."""
        unseen = self._robot.clock.time() - followed.recognized_at
        scan = self._robot[Lidar].scan
        if followed.place is None or scan is None or not UNSEEN < unseen <= BY_LIDAR_MAX:
            return
        here = self._robot[Odometry].reading.pose
        if scan.stamp <= followed.ranged_at or here.point.distance_to(followed.place) > TOO_NEAR:
            return
        followed.ranged_at = scan.stamp
        last = Pose(followed.place.x, followed.place.y).relative_to(here).point
        if (now := thing_at(self._reader.read(scan).points, last)) is not None:
            followed.spot(here.compose(Pose(now.x, now.y)).point, scan.stamp, here)

    def _see(self, followed: _Followed, scan: LaserScan | None) -> None:
        """Update the place of the followed thing by a new scan."""
        if scan is None or scan.stamp <= followed.ranged_at or followed.place is None:
            return
        followed.ranged_at = scan.stamp
        here = self._robot[Odometry].reading.pose
        last = Pose(followed.place.x, followed.place.y).relative_to(here).point
        if (now := moved_thing(self._reader.read(scan).points, last)) is not None:
            followed.spot(here.compose(Pose(now.x, now.y)).point, scan.stamp, here)

    async def _run(
        self,
        action: Action,
        followed: _Followed,
        look: Callable[[], None],
        side: FollowSide,
        distance: float,
        why: str,
    ) -> None:
        """Follow until cancelled; ``why``: the error if the followed is lost for long."""
        robot, base, self._followed = self._robot, self._robot[Base], followed
        while True:
            if await action.hold(lambda: base.set_velocity(STILL)):
                followed.seen_at = robot.clock.time()
            look()
            age = robot.clock.time() - followed.seen_at
            if age > GIVE_UP_AFTER:
                raise NotFound(why)
            if followed.place is None:
                action.report("searching")
                base.set_velocity(STILL)
            else:
                hidden = age > OUT_OF_SIGHT
                twist, free = self._keep(followed, side, distance, hidden=hidden)
                action.report("searching" if hidden else "following" if free else "waiting")
                base.set_velocity(twist)
            await robot.clock.sleep(PERIOD)

    def _spot(self, followed: _Followed, sighting: Sighting[PersonSeen]) -> None:
        for person in sighting.seen:
            if followed.number in (None, person.number):
                followed.number = person.number
                seen_from = self._robot[Odometry].reading.pose
                place = seen_from.compose(Pose(person.place.x, person.place.y)).point
                followed.spot(place, sighting.stamp, seen_from)
                followed.recognized_at = sighting.stamp
                return

    def _range(self, followed: _Followed, tag: TagReading) -> None:
        """Move the estimated place part of the way to a new ranging, which is inaccurate."""
        here, followed.ranged_at = self._robot[Odometry].reading.pose, tag.stamp
        heard = here.compose(Pose(tag.distance * math.cos(tag.azimuth), tag.distance * math.sin(tag.azimuth)))
        share = TAG_FRESH if tag.line_of_sight else TAG_FRESH / 3
        old = followed.place or heard.point
        place = Point(old.x + share * (heard.x - old.x), old.y + share * (heard.y - old.y))
        followed.spot(place, tag.stamp, here)

    def _keep(self, followed: _Followed, side: FollowSide, distance: float, *, hidden: bool) -> tuple[Twist, bool]:
        """Return the velocity to the robot's place near the person, and whether the way is free.

        ``hidden``: to the last sighting, and there turn to the person's course.
        """
        assert followed.place is not None
        here = self._robot[Odometry].reading.pose
        bearing = math.remainder(here.point.bearing_to(followed.place) - here.yaw, math.tau)
        if hidden:
            goal = followed.place
        else:
            out = here.point.bearing_to(followed.place) + math.pi
            if side is not FollowSide.BEHIND:
                out = followed.course + (BESIDE if side is FollowSide.LEFT else -BESIDE)
            goal = Point(followed.place.x + distance * math.cos(out), followed.place.y + distance * math.sin(out))
        left = here.point.distance_to(goal)
        if hidden and left < ROUND_THE_CORNER:
            return Twist(yaw=bounded(TURN_GAIN * math.remainder(followed.course - here.yaw, math.tau), TURN_RATE)), True
        if left < CLOSE or (side is FollowSide.BEHIND and here.point.distance_to(followed.place) < distance):
            return Twist(yaw=bounded(TURN_GAIN * bearing, TURN_RATE)), True
        scan = self._robot[Lidar].scan
        heading = math.remainder(here.point.bearing_to(goal) - here.yaw, math.tau)
        if scan is None or not sees(scan, heading):
            return STILL, False
        seen = self._reader.read(scan).points
        if hidden and left < TOO_NEAR and room(seen, self._robot.description.radius, heading) < left:
            return self._step_back(bearing, seen), True
        heading, left, straight = self._way(followed, here, seen, heading, left)
        return self._towards(heading, left, bearing if straight else heading, seen)

    def _step_back(self, bearing: float, seen: Points) -> Twist:
        """Return the velocity that faces a person too near for the camera and backs away."""
        behind = room(seen, self._robot.description.radius, math.pi)
        turn = bounded(TURN_GAIN * bearing, TURN_RATE)
        return Twist(-BACK if behind > GAP + BACK and abs(bearing) < BACK_BEARING else 0.0, 0.0, turn)

    def _way(
        self, followed: _Followed, here: Pose, seen: Points, heading: float, left: float
    ) -> tuple[float, float, bool]:
        """Return direction (base_link, rad) and distance (m) to drive, and whether it is the straight way."""
        radius = self._robot.description.radius
        if room(seen, radius, heading) > min(left, AHEAD):
            followed.around = None
            return heading, left, True
        if (point := followed.trail.aim(here, seen, radius)) is not None:
            ahead = Pose(point.x, point.y).relative_to(here)
            followed.around = None
            return math.atan2(ahead.y, ahead.x), max(CLOSE, math.hypot(ahead.x, ahead.y)), False
        last = None if followed.around is None else followed.around - here.yaw
        if (free := gap(seen, radius, heading, last)) is None:
            return heading, left, True
        followed.around = free + here.yaw
        return free, left, False

    def _towards(self, heading: float, left: float, facing: float, seen: Points) -> tuple[Twist, bool]:
        """Return the velocity towards ``heading`` within the free room, turning to ``facing``, and if there is room."""
        turn = bounded(TURN_GAIN * facing, TURN_RATE)
        free = room(seen, self._robot.description.radius, heading)
        speed = min(SPEED, GAIN * left, math.sqrt(2.0 * BRAKING * max(0.0, free - GAP)))
        if self._robot[Base].limits.holonomic:
            return Twist(speed * math.cos(heading), speed * math.sin(heading), turn), free > GAP
        turn = bounded(TURN_GAIN * heading, TURN_RATE)
        return Twist(speed * max(0.0, math.cos(heading)) ** 2, 0.0, turn), free > GAP
