"""What a Slamware robot has besides wheels and lidar: asked for at every connection, added when it first answers."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.capabilities import announce
from roboglot.drivers.shared import Shared
from roboglot.drivers.shared_state import KeptDrawings, KeptPlaces
from roboglot.drivers.slamware.cargo import SlamwareCargo
from roboglot.drivers.slamware.condition import SlamwareCondition, SlamwareEmergencyStop, SlamwarePower
from roboglot.drivers.slamware.drawings import SlamwareDrawings
from roboglot.drivers.slamware.jack import SlamwareJack
from roboglot.drivers.slamware.light import SlamwareLight
from roboglot.drivers.slamware.network import SlamwareNetwork
from roboglot.drivers.slamware.places import SlamwarePlaces
from roboglot.drivers.supervisor import Keeper
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system.network import Network
from roboglot.model.events import AnnotationsChanged, PlacesChanged
from roboglot.model.robot import Robot

Ask = Callable[[], Awaitable[None]]


class Outfit:
    """``parts``: what the watch asks for again and again, with its period in s."""

    def __init__(self, robot: Robot, client: SlamwareClient, keeper: Keeper) -> None:
        self._robot, self._keeper = robot, keeper
        self._jack, self._cargo = SlamwareJack(robot, client, keeper), SlamwareCargo(robot, client, keeper)
        self._condition = SlamwareCondition(robot, client)
        self._stop = SlamwareEmergencyStop(robot, client, keeper, self._condition)
        self._power = SlamwarePower(robot, client, keeper)
        self._network = SlamwareNetwork(robot, client, keeper)
        self._light = SlamwareLight(robot.clock, client, keeper)
        self._places = Shared(robot, keeper, KeptPlaces(robot), SlamwarePlaces(client), PlacesChanged, what="places")
        self._drawings = Shared(
            robot, keeper, KeptDrawings(robot), SlamwareDrawings(client), AnnotationsChanged, what="drawings"
        )
        self.parts: tuple[tuple[str, float, Ask], ...] = (
            ("health", 0.5, self._condition.refresh),
            ("power", 1.0, self._power.refresh),
            ("jack", 0.5, self._jack.refresh),
            ("cargo", 1.0, self._cargo.refresh),
            ("network", 5.0, self._network.refresh),
            *((("places", 2.0, self._places.sync), ("drawings", 5.0, self._drawings.sync)) if keeper.touches else ()),
        )

    @asynccontextmanager
    async def replacing_map(self) -> AsyncIterator[None]:
        """Within, the robot gets another map, and loses what is drawn on it: it is told again what is kept here."""
        async with self._places.forgotten(), self._drawings.forgotten():
            yield
        await self._places.sync()
        await self._drawings.sync()

    async def learn(self, has: Callable[[str], bool]) -> None:
        """Add what there is. ``has``: whether the robot answered for that part. Raises ClientError if it is gone."""
        if has("jack"):
            await announce(self._robot, Jack, self._jack)
        if has("cargo") and self._cargo.compartments:
            await announce(self._robot, Cargo, self._cargo)
        if has("network"):
            await announce(self._robot, Network, self._network, self._network.learn())
        if not self._keeper.touches:
            return
        if has("health"):
            await announce(self._robot, EmergencyStop, self._stop, self._stop.learn())
        if has("power"):
            await announce(self._robot, Power, self._power, self._power.learn())
        await announce(self._robot, Light, self._light, self._light.learn())
