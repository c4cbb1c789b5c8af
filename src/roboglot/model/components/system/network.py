"""The robot's network: its Wi-Fi card, as station or access point, and a mobile modem if it has one."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum

from roboglot.model.action import Action
from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal
from roboglot.values import dataclass

WIFI = "wifi"  # the resource of joining a network
SSID_MAX = 32  # bytes
PASSWORD_MIN, PASSWORD_MAX = 8, 63  # characters; "" is an open network
APN_MAX = 100  # characters
KNOWN_MAX = 32  # networks that the robot remembers


def check_network(ssid: str, password: str) -> None:
    """Raise InvalidGoal for a name or password that no network has."""
    if not 1 <= len(ssid.encode()) <= SSID_MAX:
        raise InvalidGoal(f"the name of a network has 1 to {SSID_MAX} bytes")
    if password and not PASSWORD_MIN <= len(password) <= PASSWORD_MAX:
        raise InvalidGoal(f"a password has {PASSWORD_MIN} to {PASSWORD_MAX} characters")


class NetworkMode(StrEnum):
    """Mode of the Wi-Fi card."""

    STATION = "station"  # joins a known network
    ACCESS_POINT = "access_point"  # provides a network that others join
    OFF = "off"


class Uplink(StrEnum):
    """Ways to the internet."""

    WIFI = "wifi"
    MOBILE = "mobile"


@dataclass(frozen=True, slots=True)
class WifiNetwork:
    """A Wi-Fi network in range; ``signal`` of its strongest access point, dBm; ``secured``: needs a password."""

    ssid: str
    signal: float
    secured: bool


@dataclass(frozen=True, slots=True)
class NetworkState:
    """Current settings and addresses of the Wi-Fi card and the wired socket.

    ``ssid``: of the network that it has joined, or offers; "" without. ``address``: its IPv4 address there, "" without;
    ``gateway``: the address of the network's gateway, "" without. ``wired``: address and prefix length of the socket on
    the hull ("" for robots without one). ``internet``: True if the internet is reached, ``route``: by which uplink.
    """

    mode: NetworkMode
    ssid: str
    address: str
    gateway: str
    mac: str
    wired: str
    dhcp: bool
    internet: bool
    route: Uplink | None


@dataclass(frozen=True, slots=True)
class MobileState:
    """``signal`` in dBm; ``registered``: True if the operator accepts the modem with this access point name."""

    apn: str
    signal: float
    registered: bool


class Network(Component):
    """State and settings of Wi-Fi card and modem. Settings survive restarts. Publishes ``NetworkChanged``.

    Setting methods return once the setting is on disk; the link follows within seconds of robot time.
    """

    signal_min: float = -88.0  # dBm below which every connection breaks
    delay: float = 0.0  # s by which everything that the robot sends is late at present

    @property
    def connected(self) -> bool:
        """True if it has joined a network as a station and the signal is strong enough."""
        return self.signal >= self.signal_min

    @property
    @abstractmethod
    def signal(self) -> float:
        """Received strength of its network in dBm (about -30 near the access point, -90 at the edge, less without)."""

    @property
    @abstractmethod
    def state(self) -> NetworkState:
        """Current state."""

    @property
    @abstractmethod
    def networks(self) -> Sequence[WifiNetwork]:
        """Networks in range of the card, strongest first; empty while it is off."""

    @property
    @abstractmethod
    def known(self) -> Sequence[str]:
        """Names of the networks that it joins by itself, preferred first."""

    @property
    @abstractmethod
    def priority(self) -> Uplink:
        """Uplink that is preferred when there are both."""

    @property
    @abstractmethod
    def mobile(self) -> MobileState | None:
        """State of the modem; None for robots without one."""

    @abstractmethod
    def join(self, ssid: str, password: str = "", *, source: str = "") -> Action:
        """Join a network as a station and remember it; takes some seconds.

        Raises InvalidGoal for impossible names or passwords; aborts with NotFound out of range and Refused for a wrong
        password: the robot then stays in its previous network.
        """

    @abstractmethod
    async def forget(self, ssid: str) -> None:
        """Forget a network, leaving it if joined. Raises NotFound."""

    @abstractmethod
    async def be_station(self) -> None:
        """Become a station: join known networks, preferred first."""

    @abstractmethod
    async def be_access_point(self, ssid: str | None = None, password: str | None = None) -> None:
        """Become an access point; None: name and password as last time, or the factory's. Raises InvalidGoal."""

    @abstractmethod
    async def switch_off(self) -> None:
        """Turn Wi-Fi off until the next command."""

    @abstractmethod
    async def set_dhcp(self, on: bool) -> None:
        """Switch DHCP; off: the current (or last) address is used in every network."""

    @abstractmethod
    async def set_priority(self, priority: Uplink) -> None:
        """Set the uplink that is preferred when there are both."""

    @abstractmethod
    async def set_apn(self, apn: str) -> None:
        """Set the mobile operator's access point name. Raises ComponentMissing without a modem, InvalidGoal."""
