"""The Wi-Fi interface of a Slamware robot, and its modem if there is one."""

from __future__ import annotations

import contextlib

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.drivers.reported_network import ReportedNetwork
from roboglot.drivers.slamware.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.system.network import (
    WIFI,
    MobileState,
    NetworkMode,
    Uplink,
    check_network,
)
from roboglot.model.errors import Expired
from roboglot.model.robot import Robot
from roboglot.wire.slamware.chapters.system.network import (
    ApnStatus,
    NetworkRequest,
    RequestedMode,
    RouteStatus,
    StationOptions,
)

JOINED_WITHIN, PERIOD = 30.0, 0.5  # s


class SlamwareNetwork(ReportedNetwork):
    """``network/*``. The internet is not reported: assumed reachable with any network."""

    def __init__(self, robot: Robot, client: SlamwareClient, supervisor: Supervisor) -> None:
        super().__init__(robot)
        self._client, self._supervisor = client, supervisor
        self._priority, self._apn = Uplink.WIFI, ""

    async def refresh(self) -> None:
        """Poll the network. Raises SlamwareRefused if the robot does not report it."""
        status = (await self._client.get_network_status()).networkstatus
        station = status.mode.upper() != "AP"
        mode = NetworkMode.STATION if station else NetworkMode.ACCESS_POINT
        internet = station and bool(status.ssid)
        self.take(mode, status.ssid, status.ip, status.mac, status.quality, internet=internet)

    async def probe(self) -> None:
        """Poll what rarely changes."""
        with contextlib.suppress(SlamwareRefused):
            self._priority = (
                Uplink.WIFI if (await self._client.get_network_route()).priority == "wifi" else Uplink.MOBILE
            )
        with contextlib.suppress(SlamwareRefused):
            self._apn = (await self._client.get_cmlink_apn()).apn

    @property
    def priority(self) -> Uplink:
        return self._priority

    @property
    def mobile(self) -> MobileState | None:
        """State of the modem; its signal is not reported, so the weakest usable one is returned."""
        return MobileState(self._apn, self.signal_min, registered=False) if self._apn else None

    def join(self, ssid: str, password: str = "", *, source: str = "") -> Action:
        check_network(ssid, password)
        self._supervisor.link.require()

        async def run(_: Action) -> None:
            clock, begun = self._robot.clock, self._robot.clock.time()
            await self._set(RequestedMode.STATION, ssid, password)
            while self.state.ssid != ssid:
                if clock.time() - begun > JOINED_WITHIN:
                    raise Expired(f"the robot is not in {ssid}")
                await clock.sleep(PERIOD)

        return self._robot.actions.start("join a network", run, resources=[WIFI], goal=ssid, source=source)

    async def be_access_point(self, ssid: str | None = None, password: str | None = None) -> None:
        await self._set(RequestedMode.ACCESS_POINT, ssid, password)

    async def switch_off(self) -> None:
        await self._set(RequestedMode.OFF)

    async def set_dhcp(self, on: bool) -> None:
        await self._set(RequestedMode.DHCP if on else RequestedMode.NO_DHCP)

    async def set_priority(self, priority: Uplink) -> None:
        self._supervisor.link.require()
        with robot_errors():
            await self._client.set_network_route(RouteStatus("wifi" if priority is Uplink.WIFI else "4g"))
        self._priority = priority

    async def set_apn(self, apn: str) -> None:
        if not self._apn:
            await super().set_apn(apn)
        self._supervisor.link.require()
        with robot_errors():
            await self._client.set_cmlink_apn(ApnStatus(apn))
        self._apn = apn

    async def _set(self, mode: RequestedMode, ssid: str | None = None, password: str | None = None) -> None:
        self._supervisor.link.require()
        with robot_errors():
            await self._client.set_network_status(NetworkRequest(mode, StationOptions(ssid, password)))
