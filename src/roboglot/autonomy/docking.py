"""Docking: to a place in front of the dock, a look at where it stands, then backwards onto the contacts at the rear."""

from __future__ import annotations

import math
import statistics

from roboglot.autonomy.base_actions import PERIOD, stand_still, start_on_base
from roboglot.autonomy.course import Goal
from roboglot.autonomy.dock_finder import find_dock
from roboglot.autonomy.navigation import GridNavigation
from roboglot.autonomy.scan_points import ScanReader
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.base import Base
from roboglot.model.components.battery import DockContact
from roboglot.model.components.docking import Docking
from roboglot.model.components.localization import Localization
from roboglot.model.components.navigation import NavigationFeedback, NavigationOptions
from roboglot.model.components.odometry import Odometry
from roboglot.model.errors import Blocked, DockNotFound, InvalidGoal
from roboglot.model.events import DockContactChanged, MapReplaced, ScanTaken
from roboglot.model.geometry import ORIGIN, STILL, Pose, Twist, wrap_angle
from roboglot.model.robot import Robot

STAGING = 0.6  # m in front of the dock from where it backs up
APPROACH_SPEED, CONTACT_SPEED = 0.2, 0.04  # m/s far from and close to the contacts: emergency braking lets who creeps
SLOW_FROM = 0.18  # m before the contacts
OVERRUN = 0.06  # m behind where the contacts should be that are tried
STUCK_SECONDS = 2.0  # without getting on
PROGRESS = 0.004  # m
ROOM_TO_TURN = 0.45  # m ahead of the contacts
LOOKS, LOOK_SECONDS = 5, 2.0  # scans that are looked at, and how long they are waited for
ASIDE, MOVED = 0.04, 0.03  # m beside, from where it was: from when on the approach is repeated, the place learnt anew
LEAN, LEAN_MAX = 4.0, 0.4  # rad per m beside the axis, for a base that cannot go sideways
SIDE_GAIN, TURN_GAIN = 2.0, 3.0  # 1/s
SIDE_SPEED, TURN_RATE = 0.1, 0.5  # m/s, rad/s
SIDE_SHIFTS = (0.0, 0.02, -0.02)  # m to the left that each try aims at: the map may be a little off


class RearDocking(Docking):
    """Knows the dock from having stood on it."""

    def __init__(self, robot: Robot, navigation: GridNavigation) -> None:
        self._robot = robot
        self._navigation = navigation
        self._home: Pose | None = ORIGIN if robot[DockContact].docked else None
        self._listeners = [
            robot.events.listen(DockContactChanged, self._touched),
            robot.events.listen(MapReplaced, self._moved),
        ]

    def close(self) -> None:
        """Stop listening."""
        for stop in self._listeners:
            stop()

    @property
    def home(self) -> Pose | None:
        return self._home

    def set_home(self, pose: Pose | None) -> None:
        if pose is not None and not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise InvalidGoal(f"not a place on this map: {pose}")
        self._home = pose

    def dock(self, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        return start_on_base(self._robot, "dock", self._run, goal=self._home, source=source, on_busy=on_busy)

    def _touched(self, event: DockContactChanged) -> None:
        if event.docked and self._home is None:
            self._home = self._robot[Localization].pose

    def _moved(self, event: MapReplaced) -> None:
        """The map has a new origin: the dock stays where it is."""
        if self._home is not None:
            self._home = None if event.origin is None else self._home.relative_to(event.origin)

    def undock(self, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        return start_on_base(self._robot, "undock", self._leave, goal=None, source=source, on_busy=on_busy)

    async def _leave(self, action: Action) -> None:
        """Ahead by odometry: right at the dock, the map may not be there yet."""
        if not self._robot[DockContact].docked:
            return
        action.report("leaving")
        base, odometry, clock = self._robot[Base], self._robot[Odometry], self._robot.clock
        start, farthest, farthest_at = odometry.reading.pose, 0.0, clock.time()
        while farthest < ROOM_TO_TURN:
            if await action.hold(lambda: base.set_velocity(STILL)):
                farthest_at = clock.time()
            gone = odometry.reading.pose.relative_to(start).x
            if gone > farthest + PROGRESS:
                farthest, farthest_at = gone, clock.time()
            if clock.time() - farthest_at > STUCK_SECONDS:
                raise Blocked("something holds the robot on its dock")
            base.set_velocity(Twist(x=APPROACH_SPEED))
            await clock.sleep(PERIOD)

    async def _run(self, action: Action) -> None:
        contact = self._robot[DockContact]
        for shift in SIDE_SHIFTS:
            if contact.docked:
                break
            if self._home is None:
                raise DockNotFound("no dock is known")
            action.report("approaching")
            await self._approach(action, self._home)
            seen = await self._look(self._home)
            if seen is not None and abs(seen.relative_to(self._home).y) > ASIDE:
                await self._approach(action, seen)  # somebody moved it: to the place before where it is now
                seen = await self._look(seen) or seen
            action.report("docking")
            goal = seen or self._home.compose(Pose(0.0, shift, 0.0))
            await self._back_up(action, goal)
            await stand_still(self._robot)
            if contact.docked and seen is not None and seen.distance_to(self._home) > MOVED:
                self._home = self._robot[Localization].pose
        if not contact.docked:
            raise DockNotFound(f"nothing touched in {len(SIDE_SHIFTS)} tries")
        action.report("docked")

    async def _approach(self, action: Action, home: Pose) -> None:
        staging = home.compose(Pose(STAGING, 0.0, 0.0))
        await self._navigation.drive(action, Goal((staging.point,), NavigationOptions(yaw=home.yaw)), _unheard)

    async def _look(self, home: Pose) -> Pose | None:
        """Where base_link would stand docked, by what the lidar sees near ``home``; None if it sees no dock."""
        robot, radius = self._robot, self._robot.description.radius
        taken: list[ScanTaken] = []
        stop = robot.events.listen(ScanTaken, taken.append)
        try:
            deadline = robot.clock.time() + LOOK_SECONDS
            while len(taken) < LOOKS and robot.clock.time() < deadline:
                await robot.clock.sleep(PERIOD)
        finally:
            stop()
        front, reader = home.compose(Pose(-radius)), ScanReader()
        pose = robot[Localization].pose
        sightings = [find_dock(reader.read(event.scan).points, front.relative_to(pose)) for event in taken]
        found = [sighting for sighting in sightings if sighting is not None]
        if len(found) < LOOKS // 2 + 1:
            return None
        x, y, turn = (
            statistics.median(values)
            for values in zip(*((f.x, f.y, wrap_angle(f.yaw - found[0].yaw)) for f in found), strict=True)
        )
        return pose.compose(Pose(x, y, wrap_angle(found[0].yaw + turn))).compose(Pose(radius))

    async def _back_up(self, action: Action, home: Pose) -> None:
        """Slowly backwards along the dock's axis until the contacts touch or nothing moves any more."""
        robot, clock = self._robot, self._robot.clock
        base, contact, localization = robot[Base], robot[DockContact], robot[Localization]
        closest, closest_at = math.inf, clock.time()
        while not contact.docked:
            if await action.hold(lambda: base.set_velocity(STILL)):
                closest_at = clock.time()
            seen = localization.pose.relative_to(home)  # x: what is left; y and yaw: how far off the axis
            if seen.x < closest - PROGRESS:
                closest, closest_at = seen.x, clock.time()
            if seen.x < -OVERRUN or clock.time() - closest_at > STUCK_SECONDS:
                return
            speed = APPROACH_SPEED if seen.x > SLOW_FROM else CONTACT_SPEED
            side = _within(SIDE_SPEED, -SIDE_GAIN * seen.y)
            turn = _within(TURN_RATE, -TURN_GAIN * wrap_angle(seen.yaw))
            if not base.limits.holonomic:
                # Backwards, the heading leads to the axis; close to the contacts it only straightens.
                lean = _within(LEAN_MAX, LEAN * seen.y) if seen.x > SLOW_FROM / 2 else 0.0
                base.set_velocity(Twist(-speed, 0.0, _within(TURN_RATE, TURN_GAIN * (lean - wrap_angle(seen.yaw)))))
                await clock.sleep(PERIOD)
                continue
            # The correction lies in the dock's frame; the robot's differs by its small yaw.
            c, s = math.cos(seen.yaw), math.sin(seen.yaw)
            base.set_velocity(Twist(-c * speed + s * side, s * speed + c * side, turn))
            await clock.sleep(PERIOD)


def _within(limit: float, value: float) -> float:
    return max(-limit, min(limit, value))


def _unheard(_: NavigationFeedback) -> None:
    """The feedback of docking has its own words."""
