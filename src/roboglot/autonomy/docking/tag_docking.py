"""Docking at marks: drive to a place with a view of the mark, onto its axis, then along it with further sightings."""

from __future__ import annotations

import math

from roboglot.autonomy.docking.mark_tracker import SENSES, MarkWatch
from roboglot.autonomy.navigation.base_actions import PERIOD, stand_still, start_on_base
from roboglot.autonomy.navigation.context import Goal
from roboglot.autonomy.navigation.driving import OdometryDriving
from roboglot.autonomy.navigation.navigation import GridNavigation
from roboglot.model.actions import Action
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import NavigationOptions
from roboglot.model.components.motion.tag_docking import Mark, MarkGoal, TagDocking
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Blocked, InvalidGoal, NotFound, RobotError, Unreachable
from roboglot.model.geometry import STILL, Point, Pose, Twist, bounded, wrap_angle
from roboglot.model.robot import Robot

SPEED, CREEP = 0.2, 0.045  # m/s on the way, and where emergency braking allows only creeping
SLOW_FROM = 0.15  # m before the end
TURNING = 0.6  # rad/s
LANE = 0.5  # m before the end where the straight part begins
ON_AXIS, ON_AXIS_YAW = 0.02, math.radians(4.0)  # off the axis; beyond it starts from the straight part
GOOD, GOOD_YAW = 0.03, math.radians(4.0)  # offset at the end: m, rad
ARRIVED = 0.004  # m
STUCK_SECONDS, PROGRESS = 2.0, 0.004
LEAN, LEAN_MAX = 3.0, 0.3  # rad per m of sideways error
TURN_GAIN, TURN_RATE = 3.0, 0.5  # 1/s, rad/s
CLOSE, TOUCH = 0.1, 0.02  # m in front of the hull: the default, and the least
PLACE_MAX, DISTANCE_MAX = 3.0, 5.0  # m
ROOM_TO_TURN = 0.3  # m beyond the hull's radius
RETRIES_MAX = 20
BLIND = 0.35  # m before the end from where the mark is no longer observed: it is too near, or all around the robot


class MarkDocking(TagDocking):
    """Docking at marks; short ways are driven by odometry, which never jumps."""

    def __init__(self, robot: Robot, navigation: GridNavigation, driving: OdometryDriving) -> None:
        self._robot, self._navigation, self._driving = robot, navigation, driving
        self._docked: dict[Mark, MarkGoal] = {}  # the last mark docked at: its number of strips and their texts

    @property
    def marks(self) -> frozenset[Mark]:
        return frozenset(mark for mark, sense in SENSES.items() if sense in self._robot)

    def dock_at(self, goal: MarkGoal, *, source: str = "") -> Action:
        self._check(goal)

        async def run(action: Action) -> None:
            for tries_left in reversed(range(1 + goal.retries)):
                try:
                    await self._dock(action, goal)
                    return
                except (NotFound, Blocked, Unreachable):
                    if not tries_left:
                        raise

        return start_on_base(self._robot, "dock at mark", run, goal=goal, source=source)

    def back_off(
        self,
        mark: Mark,
        *,
        distance: float | None = None,
        ahead: bool = False,
        watchful: bool = False,
        source: str = "",
    ) -> Action:
        self._need(mark)
        way = self._robot.description.radius + ROOM_TO_TURN if distance is None else distance
        if not 0.0 < way <= DISTANCE_MAX:
            raise InvalidGoal(f"a robot backs off by at most {DISTANCE_MAX:g} m, not {distance}")

        async def run(action: Action) -> None:
            if mark is Mark.SHELF and Jack in self._robot and self._robot[Jack].stage is not JackStage.DOWN:
                action.report("lowering")
                await self._jack(up=False)
            action.report("leaving")
            goal = self._docked.get(mark, MarkGoal(mark=mark))
            watch = MarkWatch(self._robot, goal) if watchful and not ahead else None
            await self._leave(action, way if ahead else -way, watch)

        return start_on_base(self._robot, "back off from mark", run, goal=mark, source=source)

    def _check(self, goal: MarkGoal) -> None:
        self._need(goal.mark)
        radius = self._robot.description.radius
        numbers = (goal.start.x, goal.start.y, goal.start.yaw, goal.turn, goal.outside or 0.0)
        if not all(math.isfinite(number) for number in numbers):
            raise InvalidGoal("the place to dock from, the turn and the part left outside must be numbers")
        place = Point(radius + CLOSE) if goal.place is None or goal.mark is Mark.SHELF else goal.place
        if not (radius + TOUCH <= place.x <= PLACE_MAX and abs(place.y) <= PLACE_MAX):
            raise InvalidGoal(f"{place} in front of the mark is too close: the hull reaches {radius:g} m")
        if goal.outside is not None and not 0.0 <= goal.outside <= 2.0 * radius:
            raise InvalidGoal(f"a hull {2.0 * radius:g} m long cannot stay outside by {goal.outside:g} m")
        if not 0 <= goal.retries <= RETRIES_MAX or not 1 <= goal.strips <= 10:
            raise InvalidGoal(f"0 to {RETRIES_MAX} retries, 1 to 10 strips")
        if goal.lift:
            self._robot[Jack]

    def _need(self, mark: Mark) -> None:
        self._robot[SENSES[mark]]

    async def _dock(self, action: Action, goal: MarkGoal) -> None:
        action.report("approaching")
        options = NavigationOptions(yaw=wrap_angle(goal.start.yaw))
        await self._navigation.drive(action, Goal((goal.start.point,), options))
        watch = MarkWatch(self._robot, goal)
        async with watch.open():
            action.report("looking")
            await watch.find()
            rel = self._end(watch, goal).relative_to(self._here)
            if rel.x < LANE / 2 or abs(rel.y) > ON_AXIS or abs(rel.yaw) > ON_AXIS_YAW:
                await self._go(action, rel.compose(Pose(-max(LANE, watch.reach + LANE))))
                await watch.find()
            action.report("docking")
            if goal.backward:
                await self._turn(action, math.pi)
            await self._follow_axis(action, watch, goal)
        await stand_still(self._robot)
        seen = self._here.relative_to(self._end(watch, goal))
        turned = wrap_angle(seen.yaw - math.pi) if goal.backward else seen.yaw
        if abs(seen.y) > GOOD or abs(turned) > GOOD_YAW:
            raise Blocked(f"ended {seen.y:.3f} m beside and {math.degrees(turned):.1f} degrees off the mark's axis")
        await self._turn(action, goal.turn)
        if goal.lift:
            action.report("lifting")
            await self._jack(up=True)
        self._docked[goal.mark] = goal
        action.report("docked")

    @property
    def _here(self) -> Pose:
        return self._robot[Odometry].reading.pose

    def _end(self, watch: MarkWatch, goal: MarkGoal) -> Pose:
        """Return base_link's final pose in odom, facing the mark."""
        assert watch.place is not None
        radius = self._robot.description.radius
        if goal.mark is Mark.SHELF:
            x = 0.0 if goal.outside is None else watch.reach + goal.outside - radius
            return watch.place.compose(Pose(x, 0.0, math.pi))
        place = goal.place or Point(radius + CLOSE)
        return watch.place.compose(Pose(place.x, place.y, math.pi))

    async def _follow_axis(self, action: Action, watch: MarkWatch, goal: MarkGoal) -> None:
        """Drive along the mark's axis to the end, forwards or backwards. Raises Blocked."""
        base, clock, way = self._robot[Base], self._robot.clock, -1.0 if goal.backward else 1.0
        closest, closest_at = math.inf, clock.time()
        while True:
            if await action.hold(lambda: base.set_velocity(STILL)):
                closest_at = clock.time()
            end = self._end(watch, goal)
            if -self._here.relative_to(end).x > BLIND:
                watch.glance()
            seen = self._here.relative_to(end)  # x: distance left, negative; y: offset to the left of the axis
            left, yaw = -seen.x, wrap_angle(seen.yaw - (math.pi if goal.backward else 0.0))
            if left < ARRIVED:
                return
            if left < closest - PROGRESS:
                closest, closest_at = left, clock.time()
            elif clock.time() - closest_at > STUCK_SECONDS:
                raise Blocked("something holds the robot before the mark")
            # In reverse, ``yaw`` is that of the rear, so the robot moves where it points, as when driving forward.
            lean = bounded(-LEAN * seen.y * (1.0 if left > SLOW_FROM else left / SLOW_FROM), LEAN_MAX)
            turn = bounded(TURN_GAIN * wrap_angle(lean - yaw), TURN_RATE)
            base.set_velocity(Twist(way * (SPEED if left > SLOW_FROM else CREEP), 0.0, turn))
            await clock.sleep(PERIOD)

    async def _leave(self, action: Action, way: float, watch: MarkWatch | None) -> None:
        """Drive straight by ``way`` m (odometry), along the mark's axis if there is a ``watch``. Raises Blocked."""
        base, clock, start = self._robot[Base], self._robot.clock, self._here
        axis = start
        if watch is not None:
            try:
                async with watch.open():
                    axis = Pose(start.x, start.y, wrap_angle((await watch.find()).yaw + math.pi))
            except NotFound:
                pass  # nothing to align with: straight on
        farthest, farthest_at, sign = 0.0, clock.time(), math.copysign(1.0, way)
        while farthest < abs(way):
            if await action.hold(lambda: base.set_velocity(STILL)):
                farthest_at = clock.time()
            seen = self._here.relative_to(axis)
            if sign * seen.x > farthest + PROGRESS:
                farthest, farthest_at = sign * seen.x, clock.time()
            elif clock.time() - farthest_at > STUCK_SECONDS:
                raise Blocked("something holds the robot before the mark")
            lean = bounded(-sign * LEAN * seen.y, LEAN_MAX)
            turn = bounded(TURN_GAIN * wrap_angle(lean - seen.yaw), TURN_RATE)
            base.set_velocity(Twist(sign * (CREEP if farthest < SLOW_FROM / 2 else SPEED), 0.0, turn))
            await clock.sleep(PERIOD)

    async def _go(self, action: Action, goal: Pose) -> None:
        """Drive to a pose in base_link by a turn, a straight way and a turn; backwards to a pose behind."""
        bearing = math.atan2(goal.y, goal.x)
        way = 1.0 if abs(bearing) <= math.pi / 2 else -1.0
        first = bearing if way > 0 else wrap_angle(bearing + math.pi)
        await self._turn(action, first)
        await self._driving.move(action, Pose(way * math.hypot(goal.x, goal.y)), SPEED, TURNING)
        await self._turn(action, wrap_angle(goal.yaw - first))

    async def _turn(self, action: Action, angle: float) -> None:
        if angle:
            await self._driving.move(action, Pose(yaw=angle), SPEED, TURNING)

    async def _jack(self, *, up: bool) -> None:
        jack = self._robot[Jack]
        moving = jack.raise_platform(source="docking") if up else jack.lower_platform(source="docking")
        try:
            await moving.done()
        finally:
            moving.cancel("docking ended")
        if isinstance(moving.error, RobotError):
            raise moving.error.again()
        if up and not jack.loaded:
            raise NotFound("the jack met no shelf")
