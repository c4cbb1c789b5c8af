"""Optional components of a Slamware robot: probed at every connection, added when they first answer."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.capabilities import add_if_present
from roboglot.drivers.entry_sync import EntrySync
from roboglot.drivers.local_entries import LocalDrawings, LocalPlaces
from roboglot.drivers.slamware.chapters.artifact.lines_and_areas import SlamwareDrawings
from roboglot.drivers.slamware.chapters.artifact.points_of_interest import SlamwarePlaces
from roboglot.drivers.slamware.chapters.delivery import SlamwareCargo
from roboglot.drivers.slamware.chapters.system.health import SlamwareEmergencyStop, SlamwareHealth
from roboglot.drivers.slamware.chapters.system.jack import SlamwareJack
from roboglot.drivers.slamware.chapters.system.lights import SlamwareLight
from roboglot.drivers.slamware.chapters.system.network import SlamwareNetwork
from roboglot.drivers.slamware.chapters.system.power import SlamwarePower
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system.network import Network
from roboglot.model.events import AnnotationsChanged, PlacesChanged
from roboglot.model.robot import Robot

Ask = Callable[[], Awaitable[None]]


class OptionalComponents:
    """Holds every optional component. ``parts`` are their polls for telemetry, with periods in s."""

    def __init__(self, robot: Robot, client: SlamwareClient, supervisor: Supervisor) -> None:
        self._robot, self._supervisor = robot, supervisor
        self._jack, self._cargo = SlamwareJack(robot, client, supervisor), SlamwareCargo(robot, client, supervisor)
        self._health = SlamwareHealth(robot, client)
        self._stop = SlamwareEmergencyStop(robot, client, supervisor, self._health)
        self._power = SlamwarePower(robot, client, supervisor)
        self._network = SlamwareNetwork(robot, client, supervisor)
        self._light = SlamwareLight(robot.clock, client, supervisor)
        self._places = EntrySync(
            robot,
            supervisor,
            LocalPlaces(robot),
            SlamwarePlaces(client),
            PlacesChanged,
            what="places",
        )
        self._drawings = EntrySync(
            robot,
            supervisor,
            LocalDrawings(robot),
            SlamwareDrawings(client),
            AnnotationsChanged,
            what="drawings",
        )
        self.parts: tuple[tuple[str, float, Ask], ...] = (
            ("health", 0.5, self._health.refresh),
            ("power", 1.0, self._power.refresh),
            ("jack", 0.5, self._jack.refresh),
            ("cargo", 1.0, self._cargo.refresh),
            ("network", 5.0, self._network.refresh),
            *(
                (("places", 2.0, self._places.sync), ("drawings", 5.0, self._drawings.sync))
                if supervisor.touches
                else ()
            ),
        )

    @asynccontextmanager
    async def replacing_map(self) -> AsyncIterator[None]:
        """Context in which the robot gets another map and loses its drawings; they are sent again afterwards."""
        async with self._places.forgotten(), self._drawings.forgotten():
            yield
        await self._places.sync()
        await self._drawings.sync()

    async def probe(self, has: Callable[[str], bool]) -> None:
        """Add the components that ``has`` reports as answering. Raises ClientError if the robot is gone."""
        if has("jack"):
            await add_if_present(self._robot, Jack, self._jack)
        if has("cargo") and self._cargo.compartments:
            await add_if_present(self._robot, Cargo, self._cargo)
        if has("network"):
            await add_if_present(self._robot, Network, self._network, self._network.probe())
        if not self._supervisor.touches:
            return
        if has("health"):
            await add_if_present(self._robot, EmergencyStop, self._stop, self._stop.probe())
        if has("power"):
            await add_if_present(self._robot, Power, self._power, self._power.probe())
        await add_if_present(self._robot, Light, self._light, self._light.probe())
