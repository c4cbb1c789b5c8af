"""Network state as the robot reports it. Settings that its protocol lacks are refused."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.model.actions import Action
from roboglot.model.components.system.network import (
    MobileState,
    Network,
    NetworkMode,
    NetworkState,
    Uplink,
    WifiNetwork,
)
from roboglot.model.errors import ComponentMissing, Refused
from roboglot.model.events import NetworkChanged
from roboglot.model.robot import Robot

BEST, WORST = -50.0, -100.0  # dBm that count as 100 and as 0 percent
NOWHERE = NetworkState(NetworkMode.STATION, "", "", "", "", "", True, False, None)


class ReportedNetwork(Network):
    """Reports no gateway and no other networks; addresses are assumed to come from DHCP."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._state, self._percent = NOWHERE, 0.0

    def take(self, mode: NetworkMode, ssid: str, address: str, mac: str, percent: float, *, internet: bool) -> None:
        """Take over a report. ``percent`` is the signal strength, 0 to 100."""
        route = Uplink.WIFI if internet and ssid and mode is NetworkMode.STATION else None
        state = NetworkState(mode, ssid, address, "", mac, "", True, internet, route)
        changed, self._state, self._percent = state != self._state, state, min(max(percent, 0.0), 100.0)
        if changed:
            self._robot.events.publish(NetworkChanged(stamp=self._robot.clock.time(), state=state))

    @property
    def signal(self) -> float:
        return WORST + (BEST - WORST) * self._percent / 100 if self._state.ssid else WORST

    @property
    def state(self) -> NetworkState:
        return self._state

    @property
    def networks(self) -> Sequence[WifiNetwork]:
        raise Refused("this robot does not report the networks in range")

    @property
    def known(self) -> Sequence[str]:
        raise Refused("this robot does not report its known networks")

    @property
    def priority(self) -> Uplink:
        return Uplink.WIFI

    @property
    def mobile(self) -> MobileState | None:
        return None

    def join(self, ssid: str, password: str = "", *, source: str = "") -> Action:
        raise _refused()

    async def forget(self, ssid: str) -> None:
        raise _refused()

    async def be_station(self) -> None:
        raise _refused()

    async def be_access_point(self, ssid: str | None = None, password: str | None = None) -> None:
        raise _refused()

    async def switch_off(self) -> None:
        raise _refused()

    async def set_dhcp(self, on: bool) -> None:
        raise _refused()

    async def set_priority(self, priority: Uplink) -> None:
        raise _refused()

    async def set_apn(self, apn: str) -> None:
        raise ComponentMissing(MobileState)


def _refused() -> Refused:
    return Refused("this robot's network cannot be set through its protocol")
