"""The Slamware REST door: the listening socket, the application, and the door's own state of the robot."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from roboglot.extras import MissingExtra, in_words, is_there, open_uvicorn
from roboglot.model.components.mapping.storeys import Storeys
from roboglot.model.components.system.firmware import Module
from roboglot.model.events import ModuleRestarting, Rebooted, Rebooting, ShuttingDown
from roboglot.model.robot import Robot
from roboglot.protocols.browsers import Browsers
from roboglot.protocols.door import Endpoint
from roboglot.protocols.gate import Gate
from roboglot.protocols.slamware.chapters.artifact.poi_shifts import PoiShifts
from roboglot.protocols.slamware.chapters.cloud import CloudFolder
from roboglot.protocols.slamware.chapters.delivery.box_log import BoxLog
from roboglot.protocols.slamware.chapters.delivery.voice import Voice
from roboglot.protocols.slamware.chapters.firmware.updater import Updater
from roboglot.protocols.slamware.chapters.motion.action_book import ActionBook
from roboglot.protocols.slamware.chapters.motion.arrivals import Arrivals
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.chapters.motion.speed_limits import SpeedLimits
from roboglot.protocols.slamware.chapters.multi_floor.floor_maps import LoadedStoreys
from roboglot.protocols.slamware.chapters.platform.event_log import EventLog
from roboglot.protocols.slamware.chapters.slam.map_keeper import MapKeeper
from roboglot.protocols.slamware.chapters.statistics.lifetime_totals import Totals
from roboglot.protocols.slamware.chapters.system.laser import Laser
from roboglot.protocols.slamware.chapters.system.masks import Masks
from roboglot.protocols.slamware.config import CONNECTIONS_MAX, SlamwareConfig
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.dispatch import Application
from roboglot.transport.tls import Tls
from roboglot.wire.slamware.chapters.platform import GeneralEvent

if TYPE_CHECKING:
    from roboglot.protocols.slamware.http_connection import HttpConnection, HttpConnections

GOODBYE_SECONDS = 0.3  # for answers in progress when the door closes


class SlamwareDoor:
    """Serves the API of one robot at ``address``. Port 0 is any free port; ``port`` has the actual one."""

    name = "slamware"

    def __init__(self, robot: Robot, address: str, config: SlamwareConfig, tls: Tls | None = None) -> None:
        self._robot = robot
        self._address = address
        self.port = config.port
        actions = ActionBook(robot, config.action_prefix)
        events = EventLog(robot, actions, keep=config.keep_events)
        cloud, shifts = CloudFolder(robot, config.cloud), PoiShifts(robot)
        self._voice = Voice(robot)
        self._context = Context(
            robot,
            actions,
            events,
            Laser(robot),
            MapKeeper(robot, cloud, shifts, lambda: events.note(GeneralEvent.SYNC_MAP_FROM_CLOUD)),
            SpeedLimits(robot),
            Masks(robot),
            Totals(robot),
            Updater(robot),
            BoxLog(robot),
            shifts,
            cloud,
        )
        self._arrivals = Arrivals(self._context)
        self._browsers = Browsers("[slamware]", config.origins, config.hosts, robot.admission)
        self._application = Application(self._context, self._browsers)
        self._gate = Gate(robot.admission, tls)
        self._scheme = "https" if tls else "http"
        self._connections: HttpConnections | None = None  # made, with its libraries, for the first client
        self._server: asyncio.Server | None = None
        self._endings: list[Callable[[], None]] = []
        self._opening: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Listen. Raises MissingExtra without uvicorn, OSError naming an address that is taken."""
        if not is_there("uvicorn"):  # it is loaded for the first client
            raise MissingExtra(in_words("the Slamware door", ["uvicorn"], "slamware"), name="uvicorn")
        self._browsers.warn_if_open()
        await self._listen()
        context, listen = self._context, self._robot.events.listen
        for part in (
            context.events,
            context.laser,
            context.limits,
            context.totals,
            context.boxes,
            context.shifts,
            self._arrivals,
            self._voice,
        ):
            part.start()
        await context.maps.starting.begin()
        self._arrivals.follow_car()
        if Storeys in self._robot:
            self._robot[Storeys].maps = LoadedStoreys(context)
        context.cloud.start()
        context.masks.restore()
        self._endings = [
            listen(Rebooting, lambda _: self._fall_silent()),
            listen(ShuttingDown, lambda _: self._fall_silent()),
            listen(Rebooted, lambda _: self._reopen()),
            listen(ModuleRestarting, self._module_restarting),
        ]

    async def _listen(self) -> None:
        name, most = "slamware REST", CONNECTIONS_MAX
        self._server = await self._gate.listen(self._connection, name, self._address, self.port, None, most)
        self.port = self._server.sockets[0].getsockname()[1]

    def _connection(self) -> HttpConnection:
        if self._connections is None:
            open_uvicorn()
            from roboglot.protocols.slamware.http_connection import HttpConnections

            self._connections = HttpConnections(self._application)
        return self._connections.add()

    def _fall_silent(self) -> None:
        """Stop listening, and disconnect clients once they have their answers, as the robot switches off."""
        self._context.maps.place.keep_soon()
        if self._server is not None:
            self._server.close()
            self._server = None
        for connection in self._connections.open if self._connections else ():
            connection.shutdown()

    def _reopen(self) -> None:
        """Open again; state in memory was lost in the restart."""
        self._context.masks.restore()
        starting = self._context.maps.starting.begin()
        self._opening = asyncio.get_running_loop().create_task(
            self._open_again(starting), name="slamware door opens again"
        )

    def _module_restarting(self, event: ModuleRestarting) -> None:
        """Reload the map from disk as the software begins to restart; the base has no map."""
        if event.module == Module.SOFTWARE:
            self._reopen()

    async def _open_again(self, starting: asyncio.Task[None]) -> None:
        await starting
        self._arrivals.follow_car()
        if self._server is None:
            await self._listen()

    async def close(self) -> None:
        """Stop listening, complete answers in progress, cancel the clients' actions."""
        for end in self._endings:
            end()
        if self._opening is not None:
            self._opening.cancel()
        server = self._server
        self._gate.close()
        self._fall_silent()
        for action in self._robot.actions.running():
            if action.source == SOURCE:
                action.cancel("the door closes")
        if Storeys in self._robot:
            self._robot[Storeys].maps = None
        self._close_parts()
        await self._context.maps.close()
        await self._context.totals.close()
        if self._connections is not None:
            await self._cut_off(self._connections)
        if server is not None:
            await server.wait_closed()

    async def _cut_off(self, connections: HttpConnections) -> None:
        """Wait GOODBYE_SECONDS for answers in progress, then abort the rest."""
        if connections.tasks:
            await asyncio.wait(connections.tasks, timeout=GOODBYE_SECONDS)
        self._application.closing = True
        for connection in connections.open:
            connection.transport.abort()
        for task in list(connections.tasks):
            task.cancel()

    def _close_parts(self) -> None:
        context = self._context
        for part in (
            context.events,
            context.laser,
            context.limits,
            context.updater,
            context.boxes,
            context.shifts,
            context.cloud,
            self._arrivals,
            self._voice,
        ):
            part.close()

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The address, with a request that every body answers."""
        address = f"{self._scheme}://{self._address}:{self.port}"
        return [Endpoint("Slamware REST", address, f"curl {address}/api/core/system/v1/power/status")]
