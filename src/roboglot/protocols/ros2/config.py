"""Settings of the ROS 2 door."""

from __future__ import annotations

from dataclasses import field

from roboglot.config import Port
from roboglot.values import dataclass

DOMAIN_MAX = 232


@dataclass(frozen=True, slots=True)
class Ros2Config:
    """ROS 2 over Zenoh, on request. ``port`` of the Zenoh router that each robot is at its own address.

    ``domain`` is ROS_DOMAIN_ID. ``connect``: further routers, as "tcp/HOST:7447". Topics are in the namespace of the
    robot's name, or in that of ``namespaces`` by the robot's name; "" is none. ``dead_man``: so long (s) a velocity
    counts.
    """

    enabled: bool = False
    port: Port = 7447
    domain: int = 0
    connect: tuple[str, ...] = ()
    namespaces: dict[str, str] = field(default_factory=dict)
    dead_man: float = 0.5

    def __post_init__(self) -> None:
        if not 0 <= self.domain <= DOMAIN_MAX:
            raise ValueError(f"ros2.domain must be 0 to {DOMAIN_MAX}")
        if not 0.05 <= self.dead_man <= 60:
            raise ValueError("ros2.dead_man must be 0.05 to 60 s")
        for name in self.namespaces.values():
            if name and not all(part.isidentifier() for part in name.split("/")):
                raise ValueError(f"ros2.namespaces: {name!r} cannot be a namespace")
