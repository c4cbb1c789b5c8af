"""Wi-Fi: log-distance path loss from the access points, walls and slabs in between; joining, roaming, losing; a modem.

Clients in a network that the robot left keep their connections here: doors listen on this machine.
"""

from __future__ import annotations

import asyncio
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct, field

from roboglot.model.actions import Action
from roboglot.model.components.system.network import (
    APN_MAX,
    KNOWN_MAX,
    WIFI,
    MobileState,
    Network,
    NetworkMode,
    NetworkState,
    Uplink,
    WifiNetwork,
    check_network,
)
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import ComponentMissing, InvalidGoal, NotFound, Refused
from roboglot.model.events import NetworkChanged
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative
from roboglot.simulation.radio.radio import SILENCE, Radio

PERIOD = 1.0  # s between measurements
FLOOR_OF_NOISE = -95.0
JOINING = 3.0  # s: association, key exchange, address
KEY = "network"


class Modem(Struct, frozen=True, forbid_unknown_fields=True):
    """A mobile modem: the default access point name, and the weakest usable signal, dBm."""

    apn: str
    sensitivity: Annotated[float, Meta(ge=-140, le=-40)] = -110.0


class NetworkSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A Wi-Fi card; ``noise`` in dB. ``known``: the networks (ssid: password) that a new robot joins.

    ``maker``: first half of the hardware address; ``name`` (followed by the hardware address' end), ``password`` and
    ``address``: of its own network as an access point; ``wired``: address and prefix length of the socket on the
    hull.
    """

    noise: NotNegative
    known: dict[str, str] = field(default_factory=lambda: {"roboglot": "roboglot"})
    maker: Annotated[str, Meta(pattern="^[0-9a-f]{2}:[0-9a-f]{2}:[0-9a-f]{2}$")] = "02:00:5e"
    name: Annotated[str, Meta(min_length=1, max_length=25)] = "roboglot"
    password: Annotated[str, Meta(max_length=63)] = ""
    address: str = "192.168.43.1"
    wired: str = ""
    modem: Modem | None = None


class SimulatedNetwork(Network):
    """Network that measures once a second. Its settings are one document in the robot's settings."""

    def __init__(
        self, section: NetworkSection, hull: Hull, radio: Radio, robot: Robot, random: np.random.Generator
    ) -> None:
        self._section, self._hull, self._radio, self._robot, self._random = section, hull, radio, robot, random
        tail = zlib.crc32(robot.id.encode()) & 0xFFFFFF
        self._mac = f"{section.maker}:{tail >> 16:02x}:{tail >> 8 & 255:02x}:{tail & 255:02x}"
        self._own_name = f"{section.name}-{tail:06X}"
        self._record = _Record(robot)
        self._signal = self.strongest = FLOOR_OF_NOISE
        self._ssid = ""  # of the joined network
        self._levels: tuple[tuple[float, float, int], dict[str, float]] | None = None  # place, dBm of all networks
        self._joining = False
        self._published: NetworkState | None = None
        self._known: tuple[object, ...] = ()
        self._next = -math.inf
        self.jammed = False  # whether it receives no signal at all
        self.sense(0.0, 0.0)

    @property
    def signal(self) -> float:
        return self._signal

    @property
    def state(self) -> NetworkState:
        mode, mobile, section = self._mode, self.mobile, self._section
        ssid = address = gateway = ""
        by_wifi = False
        match mode:
            case NetworkMode.ACCESS_POINT:
                ssid, address = self._record.get("own_name", self._own_name), section.address
                gateway = address
            case NetworkMode.STATION if self._ssid:
                point = self._radio.network(self._ssid)
                assert point is not None
                ssid, address, gateway = self._ssid, self._address(), f"{point.addresses}.1"
                by_wifi = point.internet and address.startswith(f"{point.addresses}.")
        ways = {Uplink.WIFI: by_wifi, Uplink.MOBILE: mobile is not None and mobile.registered}
        order = sorted(ways, key=lambda way: way is not self.priority)
        route = next((way for way in order if ways[way]), None)
        dhcp = not self._record.get("address", "")
        return NetworkState(mode, ssid, address, gateway, self._mac, section.wired, dhcp, route is not None, route)

    @property
    def networks(self) -> Sequence[WifiNetwork]:
        if self.jammed or self._mode is NetworkMode.OFF:
            return ()
        heard = {point.ssid: bool(point.password) for _, point in self._radio.points}
        found = [WifiNetwork(ssid, round(self._heard[ssid], 1), secured) for ssid, secured in heard.items()]
        audible = (network for network in found if network.signal >= FLOOR_OF_NOISE)
        return sorted(audible, key=lambda network: -network.signal)

    @property
    def known(self) -> Sequence[str]:
        return tuple(self._passwords)

    @property
    def priority(self) -> Uplink:
        return Uplink(self._record.get("priority", Uplink.WIFI))

    @property
    def mobile(self) -> MobileState | None:
        modem, coverage = self._section.modem, self._radio.mobile
        if modem is None:
            return None
        apn = str(self._record.get("apn", modem.apn))
        registered = apn in coverage.apns and coverage.signal >= modem.sensitivity
        return MobileState(apn, coverage.signal, registered)

    def join(self, ssid: str, password: str = "", *, source: str = "") -> Action:
        check_network(ssid, password)

        async def run(_: Action) -> None:
            self._joining = True
            try:
                await self._robot.clock.sleep(JOINING)
                point = self._radio.network(ssid)
                if point is None or self.jammed or self._heard[ssid] < self.signal_min:
                    raise NotFound(f"there is no network {ssid!r} here")
                if point.password and password != point.password:
                    raise Refused(f"{ssid} refuses this password")
                await self._change(
                    lambda: {
                        "mode": NetworkMode.STATION,
                        "known": [(ssid, password), *_all_but(ssid, self._passwords)][:KNOWN_MAX],
                    }
                )
                self._ssid = ssid
            finally:
                self._joining = False
                self._next = -math.inf

        return self._robot.actions.start("join network", run, resources=[WIFI], goal=ssid, source=source)

    async def forget(self, ssid: str) -> None:
        if ssid not in self._passwords:
            raise NotFound(f"{ssid!r} is not among the known networks")
        await self._change(lambda: {"known": _all_but(ssid, self._passwords)})

    async def be_station(self) -> None:
        await self._keep(mode=NetworkMode.STATION)

    async def be_access_point(self, ssid: str | None = None, password: str | None = None) -> None:
        name = self._record.get("own_name", self._own_name) if ssid is None else ssid
        key = self._record.get("own_password", self._section.password) if password is None else password
        check_network(name, key)
        await self._keep(mode=NetworkMode.ACCESS_POINT, own_name=name, own_password=key)

    async def switch_off(self) -> None:
        await self._keep(mode=NetworkMode.OFF)

    async def set_dhcp(self, on: bool) -> None:
        state = self.state
        if on == state.dhcp:
            return
        if not on and not (state.mode is NetworkMode.STATION and state.address):
            raise Refused("there is no address to fix yet")
        await self._keep(address="" if on else state.address)

    async def set_priority(self, priority: Uplink) -> None:
        if priority is Uplink.MOBILE and self._section.modem is None:
            raise ComponentMissing(MobileState)
        await self._keep(priority=priority)

    async def set_apn(self, apn: str) -> None:
        if self._section.modem is None:
            raise ComponentMissing(MobileState)
        if not 1 <= len(apn) <= APN_MAX or not apn.isprintable() or " " in apn:
            raise InvalidGoal(f"{apn!r} is not an access point name")
        await self._keep(apn=apn)

    def sense(self, stamp: float, _seconds: float) -> None:
        """Measure when due, and publish changes."""
        if stamp < self._next:
            return
        self._next = stamp + PERIOD
        noise = float(self._random.normal(0.0, self._section.noise))
        self.strongest = FLOOR_OF_NOISE if self.jammed else max(self._heard.values(), default=SILENCE) + noise
        listening = not self.jammed and not self._joining and self._mode is NetworkMode.STATION
        self._signal, self._ssid = self._best(noise) if listening else (FLOOR_OF_NOISE, "")
        known = self._ssid, self._radio.mobile, self._record.document
        if known != self._known:  # what the state is made of
            self._known = known[0], known[1], dict(known[2])
            if (state := self.state) != self._published:
                if self._published is not None:
                    self._robot.events.publish(NetworkChanged(stamp=stamp, state=state))
                self._published = state

    def _best(self, noise: float) -> tuple[float, str]:
        """Return signal (dBm) and name of the present network, else of the first known one that is strong enough."""
        strongest, passwords, heard = FLOOR_OF_NOISE, self._passwords, self._heard
        for ssid in sorted(passwords, key=lambda ssid: ssid != self._ssid):
            point = self._radio.network(ssid)
            if point is None or (point.password and point.password != passwords[ssid]):
                continue
            signal = heard[ssid] + noise
            if signal >= self.signal_min:
                return signal, ssid
            strongest = max(strongest, signal)
        return strongest, ""

    @property
    def _heard(self) -> dict[str, float]:
        """Signal of every network at the robot's place, dBm."""
        hull = self._hull
        place = hull.x, hull.y, hull.floor
        if self._levels is None or self._levels[0] != place:
            self._levels = place, self._radio.levels(hull.pose.point, hull.floor)
        return self._levels[1]

    def _address(self) -> str:
        """Return the robot's address in its present network."""
        return self._record.get("address", "") or self._radio.lease(self._ssid, self._mac)

    @property
    def _mode(self) -> NetworkMode:
        return NetworkMode(self._record.get("mode", NetworkMode.STATION))

    @property
    def _passwords(self) -> dict[str, str]:
        """Return the passwords by name, the preferred one first."""
        return dict(self._record.get("known", list(self._section.known.items())))

    async def _keep(self, **changes: object) -> None:
        await self._change(lambda: changes)

    async def _change(self, changes: Callable[[], Mapping[str, object]]) -> None:
        await self._record.change(changes)
        self._next = -math.inf  # the link follows at the next measurement


class _Record:
    """The settings of a robot's network that differ from the section's."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._unsaved: dict[str, object] = {}  # for a robot without settings
        self._turn = asyncio.Lock()  # of changes

    @property
    def document(self) -> dict[str, object]:
        return self._robot[Settings].get(KEY, {}) if Settings in self._robot else self._unsaved

    def get(self, name: str, default: Any) -> Any:
        return self.document.get(name, default)

    async def change(self, changes: Callable[[], Mapping[str, object]]) -> None:
        """Store what ``changes`` returns in its turn: each change begins with what the one before left."""
        async with self._turn:
            document = {**self.document, **changes()}
            if Settings in self._robot:
                await self._robot[Settings].put(KEY, document)
            else:
                self._unsaved = document


def _all_but(ssid: str, passwords: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return names and passwords of the other networks."""
    return [(name, password) for name, password in passwords.items() if name != ssid]


def _fit(fit: Fitting) -> SimulatedNetwork:
    section, chance = fit.body[NetworkSection], fit.chance("network")
    return SimulatedNetwork(section, fit.hull, fit.world.radio, fit.robot, chance)


PART = Part(
    name="network",
    interface=Network,
    section=NetworkSection,
    fit=_fit,
    sense=SimulatedNetwork.sense,
    every=5,
    first=5,
)
