"""Driving for the delivery service: off the dock, to places, home; on hold while people use the robot's screen."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.autonomy.delivery.rules import place_named
from roboglot.autonomy.navigation.context import SPEED_MAX
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.client_context import client
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.logistics.delivery import Failure, Policy
from roboglot.model.components.mapping.annotations import LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import settle
from roboglot.model.components.mapping.storeys import StoreyMaps, StoreyPlace, Storeys
from roboglot.model.components.mapping.track_graph import through_tracks
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions, Tracks
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import Blocked, EmergencyStopped, Expired, NotFound, NotLocalized, RobotError, Unreachable
from roboglot.model.events import DeliveryNews, DeliveryReported
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot

SOURCE = "delivery"
LOOK = 1.0  # s between two checks whether the robot may drive again
UNDOCK_RETRY, UNDOCK_MAX = 5.0, 120.0  # s
RATIO_MIN = 0.02
FAILURES: dict[type[RobotError], Failure] = {
    Unreachable: Failure.UNREACHABLE,
    Blocked: Failure.BLOCKED,
    NotLocalized: Failure.NOT_LOCALIZED,
    Expired: Failure.NO_LIFT,
}


class Failed(Exception):
    """An order failed."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.value)
        self.failure = failure


class DeliveryDrive:
    """One drive at a time. ``hold`` pauses it; after an emergency stop it starts again."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._allowed = asyncio.Event()
        self._allowed.set()
        self._action: Action | None = None

    @property
    def allowed(self) -> bool:
        """True if driving is not on hold."""
        return self._allowed.is_set()

    def hold(self, held: bool) -> None:
        """Pause driving, or resume it."""
        if held:
            self._allowed.clear()
            if self._action:
                self._action.pause()
        else:
            self._allowed.set()
            if self._action:
                self._action.resume()

    def report(self, news: DeliveryNews) -> None:
        """Publish ``news``."""
        self._robot.events.publish(DeliveryReported(stamp=self._robot.clock.time(), news=news))

    async def go_to(self, name: str, policy: Policy, speed: float | None) -> None:
        """Drive to the place with this name, no faster than ``speed`` (m/s). Raises Failed."""
        await settle(self._robot)
        try:
            place = place_named(self._robot, name)
        except NotFound:
            raise Failed(Failure.NO_PLACE) from None
        await self.go(place, policy, speed)

    async def go(self, known: StoreyPlace, policy: Policy, speed: float | None) -> None:
        """Drive to a place, by lift if needed, no faster than ``speed`` (m/s). Raises Failed."""
        await self._leave_dock(policy)
        await self._ride(known.floor, policy)
        place = known.place
        ratio = policy.speed_ratio
        if speed is not None:
            ratio *= speed / min(SPEED_MAX, self._robot[Base].limits.twist.x)
        options = NavigationOptions(
            yaw=place.pose.yaw if policy.yaw is None else policy.yaw,
            speed_ratio=min(1.0, max(RATIO_MIN, ratio)),
            tolerance=policy.tolerance,
            retries=policy.retries,
            tracks=policy.tracks,
            waits=policy.waits,
        )
        navigation = self._robot[Navigation]

        def start() -> Action:
            return navigation.navigate_to(self._way(place.pose.point, policy), options, source=SOURCE)

        await self._drive(start, policy)

    def _way(self, goal: Point, policy: Policy) -> list[Point]:
        """Return the goals of a drive, along the tracks' direction where that counts. Raises InvalidGoal."""
        if policy.tracks is Tracks.FREE or not policy.directed:
            return [goal]
        tracks = self._robot[MapAnnotations].current.lines_of(LineKind.TRACK)
        here = self._robot[Localization].pose.point
        return through_tracks(tracks, here, [goal], strictly=policy.tracks is Tracks.STRICT)

    async def go_home(self, policy: Policy) -> None:
        """Drive onto the dock, by lift if needed. Raises Failed."""
        if (maps := self._storeys) is not None:
            await self._ride(maps.home(), policy)
        await self._drive(lambda: self._robot[Docking].dock(source=SOURCE), policy)

    @property
    def _storeys(self) -> StoreyMaps | None:
        return self._robot[Storeys].maps if Storeys in self._robot else None

    async def _ride(self, floor: str, policy: Policy) -> None:
        """Ride to ``floor`` (empty: this one), unless there and in no car. Raises Failed."""
        maps = self._storeys
        if maps is None:
            if floor:
                raise Failed(Failure.NO_PLACE)  # the component that knew the floor is gone
            return
        await settle(self._robot)
        goal = floor or maps.current
        if maps.current != goal or maps.in_car:
            await self._drive(lambda: maps.go_to(goal, SOURCE), policy)

    async def _leave_dock(self, policy: Policy) -> None:
        robot, clock = self._robot, self._robot.clock
        if DockContact not in robot or Docking not in robot or not robot[DockContact].docked:
            return
        patience = clock.time() + UNDOCK_MAX
        while True:
            try:
                await self._drive(lambda: robot[Docking].undock(source=SOURCE), policy)
                break
            except Failed as error:
                if error.failure is not Failure.BLOCKED:
                    raise
                if clock.time() >= patience:
                    self.report(DeliveryNews.UNDOCK_FAILED)
                    raise Failed(Failure.DOCK_HELD) from None
            await clock.sleep(UNDOCK_RETRY)
        self.report(DeliveryNews.LEFT_DOCK)

    async def _drive(self, start: Callable[[], Action], policy: Policy) -> None:
        """Drive to the end; start again after an emergency stop. Raises Failed."""
        patience = self._robot.clock.time() + policy.stopped_seconds
        while True:
            await self._wait_until_free(patience)
            try:
                self._action = action = start()
            except EmergencyStopped:
                await self._robot.clock.sleep(LOOK)  # the legs are limp until a client asks the robot to stand up
                continue
            except RobotError as error:
                raise Failed(_failure_of(error)) from error
            if not self.allowed:
                action.pause()
            try:
                status = await action.done()
            finally:
                self._action = None
                action.cancel("the order ended")
            if status is ActionStatus.SUCCEEDED:
                return
            if not self._stopped() and not isinstance(action.error, EmergencyStopped):
                raise Failed(_failure_of(action.error) if status is ActionStatus.ABORTED else Failure.INTERRUPTED)
            patience = self._robot.clock.time() + policy.stopped_seconds

    async def _wait_until_free(self, patience: float) -> None:
        """Wait for the end of holds, emergency stops and other clients' drives. Raises Failed after ``patience``."""
        while not self.allowed or self._stopped() or self._taken() or self._robot.actions.running(BASE):
            if not self.allowed:
                began = self._robot.clock.time()
                await self._allowed.wait()
                patience += self._robot.clock.time() - began
                continue
            if self._robot.clock.time() >= patience:
                raise Failed(Failure.STOPPED if self._stopped() else Failure.INTERRUPTED)
            await self._robot.clock.sleep(LOOK)

    def _taken(self) -> bool:
        return Lease in self._robot and not self._robot[Lease].may_move(client())

    def _stopped(self) -> bool:
        if EmergencyStop not in self._robot:
            return False
        stop = self._robot[EmergencyStop]
        return stop.engaged or stop.brake_released


def _failure_of(error: RobotError | None) -> Failure:
    return next((failure for kind, failure in FAILURES.items() if isinstance(error, kind)), Failure.REFUSED)
