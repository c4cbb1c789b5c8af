"""Settings of block programs."""

from __future__ import annotations

from dataclasses import dataclass, field

from roboglot.config import Port, zone_of


@dataclass(frozen=True, slots=True)
class VisualConfig:
    """Block programs. ``port`` of the WebSocket, if there is to be one. ``origins`` and ``hosts`` are as in [slamware].

    ``time_zone`` is the one that conditions and programs' clocks are meant in, by its IANA name. ``cloud`` is the
    address of a cloud that keeps records and favourites; empty: none. ``cloud_token`` is an account's there.
    ``without_filter`` runs programs also where the kernel cannot filter their system calls: trusted ones only.
    """

    websocket: bool = True
    port: Port = 50053
    origins: tuple[str, ...] = ()
    hosts: tuple[str, ...] = ()
    time_zone: str = "UTC"
    cloud: str = ""
    cloud_token: str = field(default="", repr=False)
    without_filter: bool = False

    def __post_init__(self) -> None:
        zone_of(self.time_zone)
