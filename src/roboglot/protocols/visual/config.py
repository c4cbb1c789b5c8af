"""Settings of block programs."""

from __future__ import annotations

from dataclasses import field

from roboglot.config import Port, zone_of
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class VisualConfig:
    """Block programs. ``port`` is the WebSocket's, if ``websocket``. ``origins`` and ``hosts`` are as in [slamware].

    ``time_zone``: IANA name of the time zone of conditions and of programs' local time. ``cloud``: address of a cloud
    that keeps records and favourites; empty: none. ``cloud_token``: token of an account there. ``without_filter``: run
    programs even if the kernel cannot filter their system calls; for trusted programs only.
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
