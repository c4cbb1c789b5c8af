"""Settings of the VDA 5050 door."""

from __future__ import annotations

from dataclasses import field

from roboglot.config import Port
from roboglot.values import dataclass

LEVEL_MAX = 128  # characters per level of a topic


@dataclass(frozen=True, slots=True)
class Vda5050Config:
    """The MQTT broker, host or HOST:PORT; empty: no fleet control. ``version``: "3.0" or "2.1".

    Topics begin with ``interface``/v3/``manufacturer``/serial number; the serial number is the robot's own, or that of
    ``serials`` by the robot's name. ``map``: the mapId in orders. ``tls`` encrypts; ``ca``: file of the certificates
    that the broker's must be signed by; empty: those of the system.
    """

    broker: str = ""
    port: Port = 1883
    version: str = "3.0"
    interface: str = "uagv"
    manufacturer: str = "roboglot"
    serials: dict[str, str] = field(default_factory=dict)
    map: str = "map"
    username: str = ""
    password: str = field(default="", repr=False)
    tls: bool = False
    ca: str = ""
    visualization_period: float = 1.0  # s of robot time

    def __post_init__(self) -> None:
        if self.version not in ("2.1", "3.0"):
            raise ValueError(f"vda5050.version must be 2.1 or 3.0, not {self.version!r}")
        for level in (self.interface, self.manufacturer, self.map, *self.serials.values()):
            if not 0 < len(level) <= LEVEL_MAX or any(sign in level for sign in "/+#\0"):
                raise ValueError(f"vda5050: {level!r} cannot be a level of a topic")
        if not 0.1 <= self.visualization_period <= 60:
            raise ValueError("vda5050.visualization_period must be 0.1 to 60 s")
        self.address  # noqa: B018 - raises for a port that is none

    @property
    def address(self) -> tuple[str, int]:
        """Host and port of the broker. Raises ValueError."""
        if "/" in self.broker:
            raise ValueError(f"vda5050.broker must be HOST or HOST:PORT, not {self.broker!r}; tls = true encrypts")
        host, colon, port = self.broker.rpartition(":")
        if not colon or (host.count(":") and not host.startswith("[")):
            return self.broker.strip("[]"), self.port
        if not (port.isdecimal() and len(port) <= 5 and 0 < int(port) < 65536):
            raise ValueError(f"vda5050.broker: {port!r} is not a port")
        return host.strip("[]"), int(port)
