"""The Slamware driver: exposes one REST robot as components of the model."""

from __future__ import annotations

import asyncio
from dataclasses import replace

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.driver import Driver
from roboglot.drivers.reported import ReportedBattery, ReportedDockContact, ReportedImu, ReportedLidar, ReportedOdometry
from roboglot.drivers.slamware.chapters.motion.actions import ActionRunner
from roboglot.drivers.slamware.chapters.motion.base import SlamwareBase
from roboglot.drivers.slamware.chapters.motion.docking import SlamwareDocking
from roboglot.drivers.slamware.chapters.motion.driving import SlamwareDriving
from roboglot.drivers.slamware.chapters.motion.navigation import SlamwareNavigation
from roboglot.drivers.slamware.chapters.slam import SlamwareLocalization, SlamwareMapping
from roboglot.drivers.slamware.components import OptionalComponents
from roboglot.drivers.slamware.state import ReportedState
from roboglot.drivers.slamware.telemetry import TelemetryPoller
from roboglot.drivers.slamware.vocabulary import robot_errors
from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.link import OTHERS, US
from roboglot.model.robot import Robot

PORT = 1448
TIMEOUT = 0.8  # s for an answer before the link counts as lost
LEASE_PERIOD = 0.25  # s between two checks of the client that moves the robot
# Components to withdraw, by the topic that a robot without them does not report.
BY_TOPIC: dict[str, tuple[type[Component], ...]] = {
    "pose": (Localization, Navigation, Docking),
    "scan": (Lidar,),
    "map": (Mapping,),
}


class SlamwareDriver(Driver):
    """Connects ``robot`` to the REST robot at ``host``."""

    def __init__(self, robot: Robot, address: str, host: str, port: int = PORT, *, touches: bool = True) -> None:
        super().__init__(robot, address, touches=touches, robot_errors=robot_errors)
        self._client = SlamwareClient(host, port, clock=robot.clock, timeout=TIMEOUT)
        self._client.note_in(robot.tap.line("slamware", f"{host}:{port}"))
        reported = self._reported = ReportedState()
        self._optional = OptionalComponents(robot, self._client, self.supervisor)
        self._telemetry = TelemetryPoller(robot, self._client, self.link, reported, self._optional.parts)
        self._runner = ActionRunner(robot, self._client, self.link)
        self.link.stop_others_by(self._stop_others)
        self._base = SlamwareBase(robot, self._client, self.link, reported, self._runner)
        robot.add(Base, self._base)
        robot.add(Odometry, ReportedOdometry(lambda: reported.odometry, "slamware"))
        robot.add(Battery, ReportedBattery(lambda: reported.battery))
        robot.add(DockContact, ReportedDockContact(lambda: reported.docked))
        driving = robot.add(Driving, SlamwareDriving(robot, self._base, self.link, reported))
        supervisor, telemetry, runner = self.supervisor, self._telemetry, self._runner
        robot.add(Lidar, ReportedLidar(lambda: reported.scan))
        robot.add(Localization, SlamwareLocalization(self._client, supervisor, telemetry, runner, reported))
        robot.add(Mapping, SlamwareMapping(self._client, supervisor, telemetry, reported, self._optional.replacing_map))
        robot.add(Navigation, SlamwareNavigation(self._client, runner, reported, self._base))
        robot.add(Docking, SlamwareDocking(self._client, supervisor, runner, driving, reported))
        self._met = False

    async def brake(self) -> None:
        await self._base.stop()

    async def hang_up(self) -> None:
        self._client.close()

    async def begin(self) -> None:
        plate = await self._client.get_robot_info()
        self.recognise(plate.device_id)
        self.robot.description = replace(
            self.robot.description,
            maker=plate.manufacturer_name,
            model=plate.model_name,
            serial=plate.device_id,
            hardware_version=plate.hardware_version,
            software_version=plate.software_version,
        )
        await self._runner.stop_orphan()
        await self._base.probe()
        await self._telemetry.once()
        if not self._met:  # later a topic may only be silent for a while
            self._met = True
            for what, interfaces in BY_TOPIC.items():
                for interface in interfaces if not self._telemetry.has(what) else ():
                    self.robot.withdraw(interface)
        if self._telemetry.has("imu") and Imu not in self.robot:
            self.robot.add(Imu, ReportedImu(lambda: self._reported.imu))
        await self._optional.probe(self._telemetry.has)

    async def serve(self) -> None:
        lease = asyncio.ensure_future(self._watch_lease())
        try:
            await self._telemetry.run()
        finally:
            lease.cancel()

    async def _watch_lease(self) -> None:
        """Keep the holder of the link up to date: the client that began the current action."""
        async for _ in self.robot.clock.every(LEASE_PERIOD):
            action = self._reported.action
            if action is not None and self._runner.beginning:
                continue  # it may be ours, with its id not known yet
            ours = action is not None and self._runner.is_ours(action)
            self.link.held_by(US if ours else OTHERS if action is not None else "")

    async def _stop_others(self) -> None:
        await self._runner.stop_others()
        self._reported.action = None
