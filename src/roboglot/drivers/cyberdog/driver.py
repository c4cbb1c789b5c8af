"""The CyberDog driver: exposes one dog as components of the model.

Autonomy walks it in short moves over servo frames and dead-reckoned odometry; the rest are the dog's own skills.
"""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Callable
from dataclasses import replace

from roboglot.clients.cyberdog import Certificates, CyberDogClient, CyberDogRefused, NoAnswer, values
from roboglot.clients.errors import BadAnswer, ClientError, LinkLost
from roboglot.drivers.cyberdog.chapters.mapping.docking import CyberDogDocking
from roboglot.drivers.cyberdog.chapters.mapping.labels import CyberDogPlaces
from roboglot.drivers.cyberdog.chapters.mapping.mapping import CyberDogMapping
from roboglot.drivers.cyberdog.chapters.mapping.navigation import CyberDogLocalization, CyberDogNavigation
from roboglot.drivers.cyberdog.chapters.mapping.tasks import Skills
from roboglot.drivers.cyberdog.chapters.motion.base import CyberDogBase
from roboglot.drivers.cyberdog.chapters.motion.legs import CyberDogLegs
from roboglot.drivers.cyberdog.chapters.motion.stairs import CyberDogStairAlignment
from roboglot.drivers.cyberdog.chapters.people.following import CyberDogFollowing
from roboglot.drivers.cyberdog.components import OptionalComponents
from roboglot.drivers.cyberdog.state import ReportedState
from roboglot.drivers.cyberdog.telemetry import StatusPoll
from roboglot.drivers.cyberdog.vocabulary import battery_of, grid_of, path_of, pose_of, robot_errors, scan_of
from roboglot.drivers.driver import Driver
from roboglot.drivers.entry_sync import EntrySync
from roboglot.drivers.local_entries import LocalPlaces
from roboglot.drivers.map_change import continues
from roboglot.drivers.reported import ReportedBattery, ReportedDockContact, ReportedLidar, ReportedOdometry
from roboglot.hosting.event_loop import together
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.following import Following
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.motion.stair_alignment import StairAlignment
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.link import OTHERS, US
from roboglot.model.errors import Refused
from roboglot.model.events import BatteryChanged, MapReplaced, PlacesChanged, ScanTaken
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.codes import Code, TaskState, TaskType

log = logging.getLogger(__name__)
FOUND_SECONDS = 10.0  # until the dog has called back
MOVING: dict[int, TaskType] = {  # states of a task that moves the dog, and the task to stop
    TaskState.NAVIGATING: TaskType.NAVIGATION,
    TaskState.OUTDOOR_NAVIGATING: TaskType.NAVIGATION,
    TaskState.MAPPING: TaskType.MAPPING,
    TaskState.OUTDOOR_MAPPING: TaskType.MAPPING,
    TaskState.DOCKING: TaskType.DOCKING,
    TaskState.TAG_FOLLOWING: TaskType.UWB_FOLLOWING,
    TaskState.FOLLOWING: TaskType.VISION_FOLLOWING,
    TaskState.THING_FOLLOWING: TaskType.VISION_FOLLOWING,
}
HANDED_OVER = 1.0  # s after our own action until heartbeats show whether another app moves the dog
SILENCE_MAX = 1.6  # s without a heartbeat, which come every half second
PROBE_PERIOD, ANSWER_MAX = 0.25, 0.8  # s between two polls; s without an answer until the link counts as lost
LOOK = 0.1  # s between two looks at the heartbeat


class CyberDogDriver(Driver):
    """Connects ``robot`` to the dog at ``host``; ``app_port``: port on which the dog calls back."""

    def __init__(
        self,
        robot: Robot,
        address: str,
        host: str,
        port: int,
        certificates: Callable[[], Certificates | None],
        *,
        app_port: int,
        touches: bool = True,
    ) -> None:
        super().__init__(robot, address, touches=touches, robot_errors=robot_errors)
        self._host, self._port, self._app_port = host, port, app_port
        self._certificates = certificates
        reported = self._reported = ReportedState()
        self._client = CyberDogClient(host, None, port=port, app_port=app_port, clock=robot.clock)
        self._client.link.line = robot.tap.line("cyberdog", f"{host}:{port}")
        self._open = False
        self._ours_at = -math.inf  # when an action of ours last moved the dog
        self._skills = Skills(robot, self._client, self.link, reported)
        self.link.stop_others_by(self._stop_others)
        self._base = CyberDogBase(self._client, robot.clock, self.link, reported, self._skills)
        robot.add(Base, self._base)
        robot.add(Legs, CyberDogLegs(robot, self._client, self.supervisor, self._base))
        robot.add(Odometry, ReportedOdometry(lambda: reported.advance_to(robot.clock.time()), "cyberdog"))
        robot.add(Battery, ReportedBattery(lambda: reported.battery))
        robot.add(DockContact, ReportedDockContact(lambda: reported.docked))
        robot.add(Localization, CyberDogLocalization(self._skills))
        robot.add(Mapping, CyberDogMapping(reported))
        robot.add(Navigation, CyberDogNavigation(self._skills))
        robot.add(Docking, CyberDogDocking(self._skills))
        robot.add(Following, CyberDogFollowing(self._skills))
        robot.add(StairAlignment, CyberDogStairAlignment(self._skills))
        self._status = StatusPoll(robot, self._client, self.link, reported)
        self._places = EntrySync(
            robot,
            self.supervisor,
            LocalPlaces(robot),
            CyberDogPlaces(robot, self._client),
            PlacesChanged,
            what="places",
        )
        self._optional = OptionalComponents(robot, self._client, self.supervisor, self._status)

    async def brake(self) -> None:
        await self._base.stop()

    async def hang_up(self) -> None:
        if self._open:
            await self._client.close()

    async def begin(self) -> None:
        if not self._open:
            # Certificates may have been exchanged since the last try, so they are read again.
            self._client.link._certificates = self._certificates()
            await self._client.link.open()
            self._open = True
        try:
            beat = await self._client.found(FOUND_SECONDS)
            self.recognise(beat.serial)
        except ClientError:
            await self._client.link.close()
            self._open = False
            raise
        self.robot.description = replace(self.robot.description, maker="Xiaomi", model="CyberDog 2", serial=beat.serial)
        if await self._skills.stop_orphan():
            self._ours_at = self.robot.clock.time()  # the next heartbeat would still suggest another app
        await self._optional.probe()
        self._beat()
        await self._read_map()

    async def _read_map(self) -> None:
        """Read the map and relocalize, as a localized dog reports its pose. A dog without a map does neither."""
        try:
            found = await self._client.get_map()
            self._take_map(found.map)
            if not self.supervisor.touches:
                return
            await self._places.sync()
            if self._skills.localized:
                return
            task = await self._client.relocalise()
        except LinkLost:
            raise
        except ClientError as error:
            log.info("%s is not localized: %s", self.link.address, error)
            return
        task.leave()  # the task continues; pose pushes show when it ends

    async def serve(self) -> None:
        try:
            await together(
                self._read(values.Pose, self._take_pose),
                self._read(values.Grid, self._take_map),
                self._read(values.LaserPoints, self._take_scan),
                self._read(values.PlannedPath, self._take_path),
                self._listen_to_heart(),
                self._status.run(),
                self._probe(),
            )
        finally:
            await self._client.link.close()  # connect with a new channel and certificates next time
            self._open = False

    async def _read(self, kind: type[values.Value], take: Callable[[values.Value], None]) -> None:
        with self._client.watch(kind) as pushes:
            async for value in pushes:
                take(value)

    async def _probe(self) -> None:
        """Poll the status, because heartbeats are too rare to detect a dead link in time."""
        async for _ in self.robot.clock.every(PROBE_PERIOD):
            with contextlib.suppress(NoAnswer, CyberDogRefused, BadAnswer):
                await self._client.text(Code.STATUS, within=ANSWER_MAX)

    async def _listen_to_heart(self) -> None:
        async for _ in self.robot.clock.every(LOOK):
            self._beat()

    def _beat(self) -> None:
        beat = self._client.heartbeat
        now = self.robot.clock.time()
        if beat is None or now - beat.at > SILENCE_MAX:
            raise LinkLost("the dog's heartbeats have stopped")
        if now - beat.at <= LOOK:
            self.link.note_update("heartbeat")
        before = self._reported.battery
        self._reported.battery = replace(battery_of(beat), **self._reported.battery_details)
        self._reported.docked = beat.wireless_charging
        self._reported.task_status = beat.task_status
        if self.robot.actions.running(BASE):
            self._ours_at = now
            self.link.held_by(US)
        else:
            others = beat.task_status in MOVING and now - self._ours_at > HANDED_OVER
            self.link.held_by(OTHERS if others else "")
        after = self._reported.battery
        if (before.percentage, before.charging) != (after.percentage, after.charging):
            self.robot.events.publish(BatteryChanged(stamp=now, percentage=after.percentage, charging=after.charging))

    async def _stop_others(self) -> None:
        kind = MOVING.get(self._reported.task_status)
        if kind is TaskType.MAPPING:
            raise Refused("another app is mapping with this robot, and its map would be lost")
        if kind is not None:
            with robot_errors():
                await self._client.stop_task(kind)
        self._ours_at = self.robot.clock.time()

    def _take_pose(self, value: values.Value) -> None:
        assert isinstance(value, values.Pose)
        self._reported.correct(pose_of(value), self.robot.clock.time())
        self.link.note_update("pose")

    def _take_map(self, value: values.Value) -> None:
        assert isinstance(value, values.Grid)
        if (grid := grid_of(value)) is None:
            return
        grown = continues(self._reported.grid, grid)
        self._reported.grid = grid
        self._reported.revision += 1
        self.link.note_update("map")
        if not grown:
            self.robot.events.publish(MapReplaced(stamp=self.robot.clock.time()))

    def _take_path(self, value: values.Value) -> None:
        assert isinstance(value, values.PlannedPath)
        self._reported.path = path_of(value)

    def _take_scan(self, value: values.Value) -> None:
        assert isinstance(value, values.LaserPoints)
        stamp = self.robot.clock.time()
        pose = self._reported.advance_to(stamp).pose
        self._reported.scan = scan = scan_of(value, pose, stamp)
        self.link.note_update("scan")
        if Lidar not in self.robot:
            self.robot.add(Lidar, ReportedLidar(lambda: self._reported.scan))
        self.robot.events.publish(ScanTaken(stamp=stamp, scan=scan, odometry=pose))
