"""Docking: drive in front of the dock, measure its pose by the lidar, then reverse onto the contacts at the rear.

An unknown dock is searched nearby: everything that looks like one is tried.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.autonomy.docking.dock_finder import SEARCH_REACH, Echoes, dock_fronts, find_dock
from roboglot.autonomy.docking.known_dock import KnownDock
from roboglot.autonomy.navigation.base_actions import PERIOD, stand_still, start_on_base
from roboglot.autonomy.navigation.context import Goal
from roboglot.autonomy.navigation.navigation import GridNavigation
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.model.actions import Action
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import BEFORE_DOCK, Docking
from roboglot.model.components.motion.navigation import NavigationOptions
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Blocked, DockNotFound, InvalidGoal, Unreachable
from roboglot.model.events import DockContactChanged, ScanTaken
from roboglot.model.geometry import STILL, Pose, Twist, bounded, wrap_angle
from roboglot.model.robot import Robot

APPROACH_SPEED, CONTACT_SPEED = 0.2, 0.04  # m/s far from and near the contacts; the emergency brake permits the second
SLOW_FROM = 0.18  # m before the contacts
OVERRUN = 0.06  # m beyond the expected place of the contacts
STUCK_SECONDS = 2.0  # without progress
PROGRESS = 0.004  # m
ROOM_TO_TURN = 0.45  # m ahead of the contacts
LOOKS, LOOK_SECONDS = 5, 2.0  # scans examined, and how long to wait for them
ASIDE, MOVED = 0.04, 0.03  # m off the axis, m from the known place, beyond which it tries again
LEAN, LEAN_MAX = 4.0, 0.4  # rad per m of sideways error, for a base that cannot move sideways
SIDE_GAIN, TURN_GAIN = 2.0, 3.0  # 1/s
SIDE_SPEED, TURN_RATE = 0.1, 0.5  # m/s, rad/s
SIDE_SHIFTS = (0.0, 0.02, -0.02)  # m to the left at which the tries aim in turn: the map may be a little off
CHARGE_SECONDS = 1.0  # to wait until the battery reports that it charges
DOCK_MIDDLE, DOCK_REACH = 0.06, 0.22  # m: behind the hull that touches it; around that, of its echoes
CANDIDATES_MAX = 3  # objects like a dock that are tried, nearest first


class RearDocking(Docking):
    """Docking with rear contacts; the dock is known from the first contact or from ``set_home``."""

    def __init__(self, robot: Robot, navigation: GridNavigation, belief: Belief) -> None:
        self._robot, self._belief = robot, belief
        self._navigation = navigation
        self._known = KnownDock(robot)
        self._stop = robot.events.listen(DockContactChanged, lambda _: self._attach())
        self._attach()

    def close(self) -> None:
        """Stop listening."""
        self._stop()
        self._known.close()

    def _attach(self) -> None:
        """Leave the dock that the robot touches out of its scans."""
        dock = (-self._robot.description.radius - DOCK_MIDDLE, 0.0, DOCK_REACH)
        self._belief.attached = (dock,) if self._robot[DockContact].docked else ()

    @property
    def home(self) -> Pose | None:
        return self._known.pose

    def set_home(self, pose: Pose | None) -> None:
        if pose is not None and not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise InvalidGoal(f"not a place on this map: {pose}")
        self._known.put(pose)

    def dock(self, *, source: str = "") -> Action:
        return start_on_base(self._robot, "dock", self._run, goal=self.home, source=source)

    def undock(self, *, source: str = "") -> Action:
        return start_on_base(self._robot, "undock", self._leave, goal=None, source=source)

    async def _leave(self, action: Action) -> None:
        """Drive ahead by odometry, as there may be no map yet. Raises Blocked."""
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
        if not contact.docked and self.home is None:
            await self._search(action)
        for shift in SIDE_SHIFTS:
            if contact.docked or self.home is None:
                break
            await self._try(action, self.home, shift)
        if not contact.docked:
            raise DockNotFound(f"no contact closed in {len(SIDE_SHIFTS)} tries")
        await self._charge()
        action.report("docked")

    async def _charge(self) -> None:
        """Wait until the battery charges, for a short time: a full one or a broken dock never does."""
        robot = self._robot
        deadline = robot.clock.time() + CHARGE_SECONDS
        while Battery in robot and not robot[Battery].state.charging and robot.clock.time() < deadline:
            await robot.clock.sleep(PERIOD)

    async def _search(self, action: Action) -> None:
        """Try the things nearby that look like a dock. Raises DockNotFound with the reasons."""
        action.report("searching")
        pose, radius = self._robot[Localization].pose, self._robot.description.radius
        scans = await self._scans()
        fronts = dock_fronts(scans[-1]) if scans else []
        if not fronts:
            raise DockNotFound(f"no dock is known, and the lidar sees none within {SEARCH_REACH:g} m")
        reasons = []
        for front in fronts[:CANDIDATES_MAX]:
            try:
                await self._try(action, pose.compose(front).compose(Pose(radius)), 0.0)
            except (Blocked, Unreachable) as error:  # it was another object, or it stands where the robot does not fit
                reasons.append(str(error))
            if self._robot[DockContact].docked:
                return
        tried = len(fronts[:CANDIDATES_MAX])
        why = f": {'; '.join(reasons)}" if reasons else ""
        raise DockNotFound(f"no dock is known, and no contact closed at {tried} things that look like one{why}")

    async def _try(self, action: Action, home: Pose, shift: float) -> None:
        """Try to dock once at ``home``; ``shift``: m to the left, used if the lidar sees no dock."""
        action.report("approaching")
        await self._approach(action, home)
        seen = await self._look(home)
        if seen is not None and abs(seen.relative_to(home).y) > ASIDE:
            await self._approach(action, seen)  # the dock was moved: drive to the place in front of it again
            seen = await self._look(seen) or seen
        action.report("docking")
        await self._back_up(action, seen or home.compose(Pose(0.0, shift, 0.0)))
        await stand_still(self._robot)
        if self._robot[DockContact].docked and seen is not None and seen.distance_to(home) > MOVED:
            self._known.put(self._robot[Localization].pose)

    async def _approach(self, action: Action, home: Pose) -> None:
        staging = home.compose(Pose(BEFORE_DOCK))
        await self._navigation.drive(action, Goal((staging.point,), NavigationOptions(yaw=home.yaw)))

    async def _look(self, home: Pose) -> Pose | None:
        """Return base_link's docked pose (map) by the lidar's scans near ``home``; None if they show no dock."""
        radius, scans = self._robot.description.radius, await self._scans()
        front, pose = home.compose(Pose(-radius)), self._robot[Localization].pose
        sightings = [find_dock(points, front.relative_to(pose)) for points in scans]
        found = [sighting for sighting in sightings if sighting is not None]
        if len(found) < LOOKS // 2 + 1:
            return None
        x, y, turn = np.median([(f.x, f.y, wrap_angle(f.yaw - found[0].yaw)) for f in found], axis=0).tolist()
        return pose.compose(Pose(x, y, wrap_angle(found[0].yaw + turn))).compose(Pose(radius))

    async def _scans(self) -> list[Echoes]:
        """Return the echoes of the next scans, in base_link (m)."""
        robot, reader = self._robot, ScanReader()
        taken: list[ScanTaken] = []
        stop = robot.events.listen(ScanTaken, taken.append)
        try:
            deadline = robot.clock.time() + LOOK_SECONDS
            while len(taken) < LOOKS and robot.clock.time() < deadline:
                await robot.clock.sleep(PERIOD)
        finally:
            stop()
        return [reader.read(event.scan).points for event in taken]

    async def _back_up(self, action: Action, home: Pose) -> None:
        """Reverse slowly along the dock's axis until the contacts touch or the robot is stuck."""
        robot, clock = self._robot, self._robot.clock
        base, contact, localization = robot[Base], robot[DockContact], robot[Localization]
        closest, closest_at = math.inf, clock.time()
        while not contact.docked:
            if await action.hold(lambda: base.set_velocity(STILL)):
                closest_at = clock.time()
            seen = localization.pose.relative_to(home)  # x: distance left; y and yaw: offset from the axis
            if seen.x < closest - PROGRESS:
                closest, closest_at = seen.x, clock.time()
            if seen.x < -OVERRUN or clock.time() - closest_at > STUCK_SECONDS:
                return
            speed = APPROACH_SPEED if seen.x > SLOW_FROM else CONTACT_SPEED
            side = bounded(-SIDE_GAIN * seen.y, SIDE_SPEED)
            turn = bounded(-TURN_GAIN * wrap_angle(seen.yaw), TURN_RATE)
            if not base.limits.holonomic:
                # In reverse, the heading steers towards the axis; near the contacts it is only straightened.
                lean = bounded(LEAN * seen.y, LEAN_MAX) if seen.x > SLOW_FROM / 2 else 0.0
                base.set_velocity(Twist(-speed, 0.0, bounded(TURN_GAIN * (lean - wrap_angle(seen.yaw)), TURN_RATE)))
                await clock.sleep(PERIOD)
                continue
            # The correction is in the dock's frame, which differs from the robot's by a small yaw.
            c, s = math.cos(seen.yaw), math.sin(seen.yaw)
            base.set_velocity(Twist(-c * speed + s * side, s * speed + c * side, turn))
            await clock.sleep(PERIOD)
