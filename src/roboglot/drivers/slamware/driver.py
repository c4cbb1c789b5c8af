"""The Slamware driver: one REST robot as the components of the model. Joins the parts of this folder."""

from __future__ import annotations

import asyncio
from dataclasses import replace

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.driver import Driver
from roboglot.drivers.reported import (
    ToldBattery,
    ToldDockContact,
    ToldImu,
    ToldLidar,
    ToldOdometry,
)
from roboglot.drivers.slamware.base import SlamwareBase
from roboglot.drivers.slamware.components import Outfit
from roboglot.drivers.slamware.docking import SlamwareDocking
from roboglot.drivers.slamware.driving import SlamwareDriving
from roboglot.drivers.slamware.errand import Errands
from roboglot.drivers.slamware.navigation import SlamwareNavigation
from roboglot.drivers.slamware.slam import SlamwareLocalization, SlamwareMapping
from roboglot.drivers.slamware.state import Newest
from roboglot.drivers.slamware.telemetry import Watch
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
TIMEOUT = 0.8  # s that the robot may take to answer before the link counts as lost
LEASE_PERIOD = 0.25  # s between two looks at who moves the robot
# What robots of this maker have as a rule, by what one that has not does not tell.
TOLD_AS: dict[str, tuple[type[Component], ...]] = {
    "pose": (Localization, Navigation, Docking),
    "scan": (Lidar,),
    "map": (Mapping,),
}


class SlamwareDriver(Driver):
    """Connects ``robot`` to the REST robot at ``host``."""

    def __init__(self, robot: Robot, address: str, host: str, port: int = PORT, *, touches: bool = True) -> None:
        super().__init__(robot, address, touches=touches)
        self._client = SlamwareClient(host, port, clock=robot.clock, timeout=TIMEOUT)
        newest = self._newest = Newest()
        self._outfit = Outfit(robot, self._client, self.keeper)
        self._watch = Watch(robot, self._client, self.link, newest, self._outfit.parts)
        self._errands = Errands(robot, self._client, self.link)
        self.link.stop_others_by(self._stop_others)
        self._base = SlamwareBase(robot, self._client, self.link, newest, self._errands)
        robot.add(Base, self._base)
        robot.add(Odometry, ToldOdometry(lambda: newest.odometry))
        robot.add(Battery, ToldBattery(lambda: newest.battery))
        robot.add(DockContact, ToldDockContact(lambda: newest.docked))
        driving = robot.add(Driving, SlamwareDriving(robot, self._base, self.link, newest))
        keeper, watch, errands = self.keeper, self._watch, self._errands
        robot.add(Lidar, ToldLidar(lambda: newest.scan))
        robot.add(Localization, SlamwareLocalization(self._client, keeper, watch, errands, newest))
        robot.add(Mapping, SlamwareMapping(self._client, keeper, watch, newest, self._outfit.replacing_map))
        robot.add(Navigation, SlamwareNavigation(self._client, errands, newest))
        robot.add(Docking, SlamwareDocking(self._client, keeper, errands, driving, newest))
        self._met = False

    async def brake(self) -> None:
        await self._base.stop()

    async def hang_up(self) -> None:
        self._client.close()

    async def begin(self) -> None:
        plate = await self._client.get_robot_info()
        self.robot.description = replace(
            self.robot.description,
            maker=plate.manufacturer_name,
            model=plate.model_name,
            serial=plate.device_id,
            hardware_version=plate.hardware_version,
            software_version=plate.software_version,
        )
        await self._errands.stop_orphan()
        await self._base.learn()
        await self._watch.once()
        if not self._met:  # later it may only be silent for a while
            self._met = True
            for what, interfaces in TOLD_AS.items():
                for interface in interfaces if not self._watch.has(what) else ():
                    self.robot.withdraw(interface)
        if self._watch.has("imu") and Imu not in self.robot:
            self.robot.add(Imu, ToldImu(lambda: self._newest.imu))
        await self._outfit.learn(self._watch.has)

    async def serve(self) -> None:
        lease = asyncio.ensure_future(self._watch_lease())
        try:
            await self._watch.run()
        finally:
            lease.cancel()

    async def _watch_lease(self) -> None:
        """Tell who moves the robot: the last to begin an action does, whatever client it came from."""
        async for _ in self.robot.clock.every(LEASE_PERIOD):
            action = self._newest.action
            if action is not None and self._errands.beginning:
                continue  # it may be the one whose number is still on its way to us
            ours = action is not None and self._errands.is_ours(action)
            self.link.held_by(US if ours else OTHERS if action is not None else "")

    async def _stop_others(self) -> None:
        await self._errands.stop_others()
        self._newest.action = None
