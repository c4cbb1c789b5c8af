"""The Slamware REST API from the client's end: all its operations, and awaitable actions.

Usable on its own::

    async with SlamwareClient("192.168.11.1") as robot:
        await (await robot.begin("MoveToAction", MoveToOptions(Location(1.0, 0.5))))
        explored = await robot.get_explore_map()   # .cells is a numpy array

Uses the vendor's units and frames; knows no driver.
"""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from roboglot.clients.slamware.calls import TIMEOUT, without_none
from roboglot.clients.slamware.chapters.artifact import Artifact
from roboglot.clients.slamware.chapters.delivery.admin import Admin
from roboglot.clients.slamware.chapters.delivery.cargo import Boxes
from roboglot.clients.slamware.chapters.delivery.tasks import Tasks
from roboglot.clients.slamware.chapters.firmware import Firmware
from roboglot.clients.slamware.chapters.industry import Industry
from roboglot.clients.slamware.chapters.motion import Motion
from roboglot.clients.slamware.chapters.multi_floor import MultiFloor
from roboglot.clients.slamware.chapters.platform import Platform
from roboglot.clients.slamware.chapters.slam.docks import Docks
from roboglot.clients.slamware.chapters.slam.localization import Localization
from roboglot.clients.slamware.chapters.slam.maps import Maps
from roboglot.clients.slamware.chapters.statistics import Statistics
from roboglot.clients.slamware.chapters.system.devices import Devices
from roboglot.clients.slamware.chapters.system.network import Network
from roboglot.clients.slamware.chapters.system.sensors import Sensors
from roboglot.clients.slamware.chapters.system.system import System
from roboglot.clients.slamware.http import HttpLink
from roboglot.clients.slamware.running import RunningAction
from roboglot.model.clock import Clock, RealClock
from roboglot.model.tap import Line
from roboglot.wire.slamware.chapters.motion import ActionInfo, ActionRequest

PORT = 1448
PREFIX = "slamtec.agent.actions."  # of action names in firmware 3 to 5; firmware 6 uses shorter ones


class SlamwareClient(
    System,
    Devices,
    Network,
    Sensors,
    Firmware,
    Statistics,
    Platform,
    Localization,
    Docks,
    Maps,
    Artifact,
    Motion,
    MultiFloor,
    Industry,
    Admin,
    Boxes,
    Tasks,
):
    """One robot. Connects at the first request, and again after a lost connection.

    Every method raises SlamwareRefused (status and words), LinkLost, TimedOut or BadAnswer.
    """

    def __init__(self, host: str, port: int = PORT, *, clock: Clock | None = None, timeout: float = TIMEOUT) -> None:
        self.clock = clock or RealClock()
        super().__init__(HttpLink(host, port, self.clock), timeout)
        self._prefix: str | None = None

    async def __aenter__(self) -> SlamwareClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disconnect. Actions of the robot continue."""
        self._link.close()

    def note_in(self, line: Line) -> None:
        """Record requests and answers in ``line``."""
        self._link.line = line

    async def begin(
        self,
        name: str,
        options: msgspec.Struct | None = None,
        on_progress: Callable[[ActionInfo], object] | None = None,
    ) -> RunningAction:
        """Start an action in place of the current one; ``name``: "MoveToAction" or the like.

        ``options``: the struct of ``wire`` for that action (MoveToOptions …). ``on_progress`` gets the action's reports
        while it is awaited.
        """
        fields: dict[str, object] = without_none(msgspec.to_builtins(options)) if options is not None else {}
        begun = await self.create_action(ActionRequest(await self._full(name), fields))
        return RunningAction(self, self.clock, begun, on_progress)

    async def _full(self, name: str) -> str:
        """Return the action's name in this robot's firmware."""
        if "." in name:
            return name
        if self._prefix is None:
            known = next((f.action_name for f in await self.get_action_factories()), PREFIX)
            self._prefix = known[: known.rfind(".") + 1]
        return self._prefix + name
