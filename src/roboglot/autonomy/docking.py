"""Docking: to a place in front of the dock, then backwards onto the contacts, which are at the robot's rear."""

from __future__ import annotations

import math

from roboglot.autonomy.base_actions import PERIOD, stand_still, start_on_base
from roboglot.autonomy.course import Goal
from roboglot.autonomy.navigation import GridNavigation
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.base import Base
from roboglot.model.components.battery import DockContact
from roboglot.model.components.docking import Docking
from roboglot.model.components.localization import Localization
from roboglot.model.components.navigation import NavigationFeedback, NavigationOptions
from roboglot.model.errors import DockNotFound, InvalidGoal
from roboglot.model.events import DockContactChanged, MapReplaced
from roboglot.model.geometry import ORIGIN, STILL, Pose, Twist, wrap_angle
from roboglot.model.robot import Robot

STAGING = 0.6  # m in front of the dock from where it backs up
APPROACH_SPEED, CONTACT_SPEED = 0.2, 0.06  # m/s far from and close to the contacts
SLOW_FROM = 0.15  # m before the contacts
OVERRUN = 0.06  # m behind where the contacts should be that are tried
STUCK_SECONDS = 2.0  # without getting on
PROGRESS = 0.004  # m
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

    async def _run(self, action: Action) -> None:
        contact = self._robot[DockContact]
        for shift in SIDE_SHIFTS:
            if contact.docked:
                break
            home = self._home
            if home is None:
                raise DockNotFound("no dock is known")
            staging = home.compose(Pose(STAGING, 0.0, 0.0))
            action.report("approaching")
            await self._navigation.drive(action, Goal((staging.point,), NavigationOptions(yaw=home.yaw)), _unheard)
            action.report("docking")
            await self._back_up(action, home.compose(Pose(0.0, shift, 0.0)))
            await stand_still(self._robot)
        if not contact.docked:
            raise DockNotFound(f"nothing touched in {len(SIDE_SHIFTS)} tries")
        action.report("docked")

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
            side = max(-SIDE_SPEED, min(SIDE_SPEED, -SIDE_GAIN * seen.y))
            turn = max(-TURN_RATE, min(TURN_RATE, -TURN_GAIN * wrap_angle(seen.yaw)))
            # The correction lies in the dock's frame; the robot's differs by its small yaw.
            c, s = math.cos(seen.yaw), math.sin(seen.yaw)
            base.set_velocity(Twist(-c * speed + s * side, s * speed + c * side, turn))
            await clock.sleep(PERIOD)


def _unheard(_: NavigationFeedback) -> None:
    """The feedback of docking has its own words."""
