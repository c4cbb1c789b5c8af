"""The RoboMaster driver: exposes one EP as components of the model.

Autonomy drives it by its wheels and odometry. The connection is the lease: the robot obeys the connected client and
stops when that connection ends.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

from roboglot.clients.errors import LinkLost, RefusedByRobot
from roboglot.clients.robomaster.client import Ports, RoboMasterClient
from roboglot.clients.robomaster.datagrams import PushPort, discover
from roboglot.drivers.driver import Driver
from roboglot.drivers.reported import ReportedBattery, ReportedOdometry
from roboglot.drivers.robomaster.chapters.chassis import RoboMasterBase
from roboglot.drivers.robomaster.components import OptionalComponents
from roboglot.drivers.robomaster.state import ReportedState
from roboglot.drivers.robomaster.telemetry import TelemetryListener
from roboglot.drivers.robomaster.vocabulary import robot_errors
from roboglot.drivers.robomaster.watchdog import Watchdog
from roboglot.model.clock import RealClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.robot import Robot
from roboglot.values import dataclass

ANYWHERE = "discover"  # as a host: the first robot that broadcasts
SEARCH_SECONDS = 5.0


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Address of an EP: ``host`` or ANYWHERE, its ports, our ``local`` address; ``bounded``: drive by short moves."""

    host: str
    ports: Ports
    local: str | None = None
    bounded: bool = True


class RoboMasterDriver(Driver):
    """Connects ``robot`` to the EP at ``endpoint``. All EPs of the program share the port of ``pushes``.

    ``own`` are the addresses of this program's doors, which broadcast like EPs and are skipped by discovery.
    """

    def __init__(
        self,
        robot: Robot,
        address: str,
        endpoint: Endpoint,
        *,
        pushes: PushPort,
        watchdog: Watchdog,
        own: Collection[str] = (),
        touches: bool = True,
    ) -> None:
        super().__init__(robot, address, touches=touches, robot_errors=robot_errors)
        self._endpoint = endpoint
        self._pushes = pushes
        self._own = own
        self._watchdog = watchdog
        self._unwatch: Callable[[], None] = lambda: None
        reported = self._reported = ReportedState()
        self._client = self._new_client()
        self._optional = OptionalComponents(robot, self._client, self.supervisor, reported)
        self._telemetry = TelemetryListener(robot, self._client, self.link, reported, self._optional.refreshed)
        self._base = RoboMasterBase(self._client, robot.clock, self.link, reported, bounded=endpoint.bounded)
        robot.add(Base, self._base)
        robot.add(Odometry, ReportedOdometry(lambda: reported.odometry, "robomaster"))
        robot.add(Battery, ReportedBattery(lambda: reported.battery))

    def _new_client(self) -> RoboMasterClient:
        at = self._endpoint
        client = RoboMasterClient(
            at.host, clock=self.robot.clock, ports=at.ports, pushes=self._pushes, local=at.local, reconnect=False
        )
        client.note_in(self.robot.tap.line("robomaster", f"{at.host}:{at.ports.control}"))
        return client

    async def brake(self) -> None:
        await self._base.stop()

    async def hang_up(self) -> None:
        await self._disconnect()

    async def begin(self) -> None:
        await self._disconnect()
        if self._endpoint.host == ANYWHERE:
            found = await discover(SEARCH_SECONDS, first=True, clock=self.robot.clock, passing_over=self._own)
            if not found:
                raise LinkLost("no free RoboMaster broadcasts here")
            self._client.host = found[0]
        await self._client.connect()
        if isinstance(self.robot.clock, RealClock):
            self._unwatch = self._watchdog.watch(self._client.descriptor, lambda: bool(self.robot.actions.running()))
        await self._client.learn_build()  # sets the units that it uses
        self._telemetry.parts = await self._optional.probe()
        await self._telemetry.begin()
        version = await self._version()
        self.robot.description = replace(
            self.robot.description, maker="DJI", model="RoboMaster EP", software_version=version
        )

    async def _version(self) -> str:
        try:
            return await self._client.version()
        except RefusedByRobot:  # undocumented command
            return ""

    async def serve(self) -> None:
        try:
            await self._telemetry.run()
        finally:
            await self._disconnect()

    async def _disconnect(self) -> None:
        self._telemetry.close()
        self._unwatch()
        await self._client.close()
