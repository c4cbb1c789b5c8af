"""Polls a Slamware robot and updates the model. Independent of the components."""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Sequence
from typing import TYPE_CHECKING

from roboglot.clients.errors import BadAnswer, LinkLost
from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.drivers.linked_base import LATENCY_SMOOTHING
from roboglot.drivers.map_change import continues
from roboglot.drivers.slamware.state import ReportedState
from roboglot.drivers.slamware.vocabulary import battery_of, grid_of, imu_of, pose_of, scan_of
from roboglot.extras import in_words, is_there, lazy
from roboglot.hosting.event_loop import together
from roboglot.model.clock import Clock
from roboglot.model.components.system.link import Link
from roboglot.model.events import BatteryChanged, DockContactChanged, MapReplaced, PoseJumped, ScanTaken
from roboglot.model.geometry import Pose, Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.model.sensing import OdometryReading
from roboglot.wire.slamware.chapters.system.system import BatteryPack, DockingStatus

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

log = logging.getLogger(__name__)
JUMP = 0.5  # m or rad between localization and odometry from which the pose counts as set by hand
ABSENT = (404, 500, 501)  # statuses for features that the robot lacks
ESSENTIAL, REFUSED_MAX = "odometry", 1.0  # a topic, and s for which a robot that has it may refuse it as if it had not
NO_ARRAYS = in_words("that", ["numpy"], "slamware")
ARRAYS = frozenset({"scan", "map"})  # topics whose values are numpy arrays


class TelemetryPoller:
    """Telemetry of one robot. ``once`` reads everything; ``run`` polls until the link breaks (LinkLost)."""

    def __init__(
        self,
        robot: Robot,
        client: SlamwareClient,
        link: Link,
        reported: ReportedState,
        parts: Sequence[tuple[str, float, Callable[[], Awaitable[None]]]],
    ) -> None:
        self._robot, self._client, self._link, self._reported = robot, client, link, reported
        self._clock: Clock = robot.clock
        self._absent: set[str] = set()
        self._met: set[str] = set()  # topics that were reported once
        self._optional = frozenset(what for what, _, _ in parts)  # bad answers about these do not break the link
        self._has_pack = True
        self._parts: tuple[tuple[str, float, Callable[[], Awaitable[None]]], ...] = (  # period in s
            ("odometry", 0.05, self._odometry),
            ("speed", 0.1, self._speed),
            ("pose", 0.1, self._pose),
            ("scan", 0.2, self._scan),
            ("action", 0.25, self._action),
            ("imu", 0.2, self._imu),
            ("battery", 1.0, self._battery),
            ("localization", 1.0, self._localization),
            ("loop closure", 5.0, self._loop_closure),
            ("home", 5.0, self._home),
            ("map", 2.0, self._watch_map),
            *parts,
        )

    def has(self, what: str) -> bool:
        """Return True if the robot reports ``what``; known after ``once``."""
        return what not in self._absent

    async def once(self) -> None:
        """Poll everything once. Topics that the robot lacks, and never had, are not polled again."""
        self._absent.clear()
        if not is_there("numpy"):
            log.warning("reading %s without scan and map: %s", self._link.address, NO_ARRAYS)
            self._absent |= ARRAYS
        for what, _, ask in self._parts:
            if what not in self._absent:
                await self._ask_first(what, ask)

    async def _ask_first(self, what: str, ask: Callable[[], Awaitable[None]]) -> None:
        """Ask for a topic, and note that it is absent if the robot lacks it."""
        try:
            await ask()
            self._note_answer(what)
        except SlamwareRefused as refused:
            if refused.code not in ABSENT:
                raise
            if what not in self._met:  # else its part of the robot is still starting
                self._absent.add(what)
        except BadAnswer as error:
            if what not in self._optional:
                raise
            log.warning("%s does not report its %s: %s", self._link.address, what, error)
            self._absent.add(what)

    async def run(self) -> None:
        """Poll until the link breaks."""
        parts = (part for part in self._parts if part[0] not in self._absent)
        await together(*(self._keep_polling(*part) for part in parts))

    async def _keep_polling(self, what: str, period: float, ask: Callable[[], Awaitable[None]]) -> None:
        heard = self._clock.time()
        async for _ in self._clock.every(period):
            try:
                await ask()
                self._note_answer(what)
                heard = self._clock.time()
            except BadAnswer:
                if what not in self._optional:
                    raise
            except SlamwareRefused as refused:  # the robot sleeps or loads a map; the age of the data shows that
                is_broken = refused.code in (*ABSENT, 502, 503, 504)
                if what == ESSENTIAL and is_broken and self._clock.time() - heard > REFUSED_MAX:
                    raise LinkLost(f"the robot no longer reports its {what}: {refused}") from None

    def _note_answer(self, what: str) -> None:
        self._link.note_update(what)
        self._met.add(what)

    async def _odometry(self) -> None:
        asked = self._clock.time()
        pose = pose_of(await self._client.get_odo_pose())
        self._reported.latency += LATENCY_SMOOTHING * (self._clock.time() - asked - self._reported.latency)
        before = self._reported.odometry
        way = before.pose.distance_to(pose) if before.stamp else 0.0
        self._reported.odometry = OdometryReading(self._clock.time(), pose, self._reported.twist, before.distance + way)

    async def _speed(self) -> None:
        speed = await self._client.get_current_speed()
        self._reported.twist = Twist(speed.vx, speed.vy, speed.omega)

    async def _pose(self) -> None:
        reported = self._reported
        before, odometry = reported.pose, reported.odometry.pose
        reported.pose = pose = pose_of(await self._client.get_pose())
        moved = reported.odometry.pose.distance_to(odometry)
        turned = abs(wrap_angle(reported.odometry.pose.yaw - odometry.yaw))
        if before.distance_to(pose) - moved > JUMP or abs(wrap_angle(pose.yaw - before.yaw)) - turned > JUMP:
            self._robot.events.publish(PoseJumped(stamp=self._clock.time(), pose=pose))

    async def _scan(self) -> None:
        reply = await self._client.get_laser_scan()
        stamp = self._clock.time()
        if not reply.laser_points:
            return
        self._reported.scan = scan = scan_of(reply, stamp)
        # The scan carries its map pose; odometry has moved on since by as much as the map pose.
        reported = self._reported
        odometry = reported.odometry.pose.compose(pose_of(reply.pose).relative_to(reported.pose))
        self._robot.events.publish(ScanTaken(stamp=stamp, scan=scan, odometry=odometry))

    async def _action(self) -> None:
        try:
            self._reported.action = (await self._client.get_current_action()).action_id
        except SlamwareRefused as refused:
            if refused.code != 404:
                raise
            self._reported.action = None

    async def _imu(self) -> None:
        self._reported.imu = imu_of(await self._client.get_imu(), self._clock.time())

    async def _battery(self) -> None:
        status, pack = await self._client.get_power_status(), await self._pack()
        reported, before, stamp = self._reported, self._reported.battery, self._clock.time()
        reported.battery = now = battery_of(status, pack)
        if round(before.percentage * 100) != round(now.percentage * 100) or before.charging != now.charging:
            self._robot.events.publish(BatteryChanged(stamp=stamp, percentage=now.percentage, charging=now.charging))
        docked = status.docking_status is DockingStatus.ON_DOCK
        if docked != reported.docked:
            reported.docked = docked
            self._robot.events.publish(DockContactChanged(stamp=stamp, docked=docked))

    async def _pack(self) -> BatteryPack | None:
        """Poll current and temperature, which not every robot reports."""
        if not self._has_pack:
            return None
        try:
            return await self._client.get_battery_pack()
        except SlamwareRefused:
            self._has_pack = False
            return None

    async def _localization(self) -> None:
        self._reported.quality = await self._client.get_localization_quality() / 100
        self._reported.localizing = await self._client.get_map_localization()
        self._reported.mapping = await self._client.get_map_update()

    async def _loop_closure(self) -> None:
        self._reported.closes_loops = await self._client.get_loop_closure()

    async def _home(self) -> None:
        try:
            self._reported.home = pose_of(await self._client.get_home_pose())
        except SlamwareRefused as refused:
            if refused.code != 404:
                raise
            self._reported.home = None  # no dock is known

    async def _map(self) -> None:
        grid, before = grid_of(await self._client.get_explore_map()), self._reported.grid
        if grid.origin == before.origin and np.array_equal(grid.log_odds, before.log_odds):
            return
        self._reported.grid = grid
        self._reported.revision += 1

    async def _watch_map(self) -> None:
        """Read the map; report one that another client has loaded or begun."""
        before = self._reported.grid
        await self._map()
        if before.log_odds.any() and not continues(before, self._reported.grid):
            self._robot.events.publish(MapReplaced(stamp=self._clock.time()))

    async def read_map(self, origin: Pose | None = None) -> None:
        """Read the map and the pose after the map was replaced; ``origin``: as in ``MapReplaced``."""
        await self._map()
        await self._pose()
        self._robot.events.publish(MapReplaced(stamp=self._clock.time(), origin=origin))
