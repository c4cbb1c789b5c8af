"""Settings of the text door."""

from __future__ import annotations

from typing import Literal

from roboglot.config import Port
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class RoboMasterConfig:
    """Ports of the text protocol: TCP control, video, audio, event; UDP push and discovery (on the client's side).

    ``profile``: behaviour of the manual (``spec``) or of a firmware build (``fw60``, ``fw70``). ``lenient`` also runs
    text without its ``;``. ``uart``: path of a pseudo-terminal to be made, "-" and the robot's name are
    appended; empty: none. ``explanation_port`` gives teaching tools the reasons of refusals, ``pilot_port`` takes the
    pilot's keyboard and mouse as text; None: it is closed.
    """

    control_port: Port = 40923
    video_port: Port = 40921
    audio_port: Port = 40922
    push_port: Port = 40924
    event_port: Port = 40925
    broadcast_port: Port = 40926
    profile: Literal["spec", "fw60", "fw70"] = "spec"
    lenient: bool = False
    uart: str = ""
    explanation_port: Port | None = None
    pilot_port: Port | None = None
