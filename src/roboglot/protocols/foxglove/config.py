"""Settings of the Foxglove door."""

from __future__ import annotations

from roboglot.config import Port
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class FoxgloveConfig:
    """The WebSocket's ``port``. ``origins`` and ``hosts`` are as in [slamware]: the vendor's web app has to be named.

    ``dead_man``: validity of a velocity, s; the Teleop panel sends one per second by default.
    """

    enabled: bool = True
    port: Port = 8765
    origins: tuple[str, ...] = ()
    hosts: tuple[str, ...] = ()
    dead_man: float = 1.5

    def __post_init__(self) -> None:
        if not 0.05 <= self.dead_man <= 60:
            raise ValueError("foxglove.dead_man must be 0.05 to 60 s")
