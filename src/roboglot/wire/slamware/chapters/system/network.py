"""Chapter "system": messages about the network."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, Literal

import msgspec

Name = Annotated[str, msgspec.Meta(max_length=64)]


class NetworkStatus(msgspec.Struct):
    """State of the network; ``ethip1`` with the prefix length, ``quality`` in percent."""

    ethip1: str
    ip: str
    mac: str
    mode: str
    quality: int
    ssid: str


class WrappedStatus(msgspec.Struct):
    """The API's wrapper of NetworkStatus."""

    networkstatus: NetworkStatus


class RequestedMode(IntEnum):
    """Requested setting."""

    ACCESS_POINT = 0
    STATION = 1
    OFF = 2
    NO_DHCP = 3
    DHCP = 4


Nothing = Annotated[list[object], msgspec.Meta(max_length=0)]  # the manual's example has [] for no options


class StationOptions(msgspec.Struct):
    """Both are required for a station and optional for an access point."""

    ssid: Name | None = None
    password: Name | None = None


class NetworkRequest(msgspec.Struct):
    """A mode and its options."""

    networkmode: RequestedMode
    options: StationOptions | Nothing | None = None


class RouteStatus(msgspec.Struct):
    """Preferred uplink."""

    priority: Literal["wifi", "4g"]


class ApnStatus(msgspec.Struct):
    """The operator's access point name, e.g. cmhk in Hong Kong."""

    apn: Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
