"""What is to be run: dataclasses filled from one TOML file, the environment and the command line.

Precedence: command line over ``ROBOGLOT_*`` environment over the file over the defaults here.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True)
class RobotConfig:
    """One robot: its name, its body, the address all its doors bind to."""

    name: str = "a"
    body: str = "universal"
    address: str = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class SlamwareConfig:
    """Where the REST door listens."""

    port: int = 1448


@dataclass(frozen=True, slots=True)
class RoboMasterConfig:
    """Ports of the text protocol: TCP control, video, audio, event; UDP push and discovery (on the client's side)."""

    control_port: int = 40923
    video_port: int = 40921
    audio_port: int = 40922
    push_port: int = 40924
    event_port: int = 40925
    broadcast_port: int = 40926


@dataclass(frozen=True, slots=True)
class CyberDogConfig:
    """gRPC door. ``app`` is "host:port" of the phone app to dial; empty: the peer of the last call at ``app_port``.

    ``plaintext`` is for tests: no TLS, and only allowed on a loopback address.
    """

    port: int = 50052
    app: str = ""
    app_port: int = 8981
    plaintext: bool = False


@dataclass(frozen=True, slots=True)
class Config:
    """Everything ``roboglot up`` needs. ``speed`` is the clock's; ``lockstep`` stops it until told to advance."""

    world: str = "office"
    robots: tuple[RobotConfig, ...] = (RobotConfig(),)
    speed: float = 1.0
    lockstep: bool = False
    seed: int = 1
    data: Path = field(default_factory=lambda: default_data_folder(os.environ))
    slamware: SlamwareConfig = SlamwareConfig()
    robomaster: RoboMasterConfig = RoboMasterConfig()
    cyberdog: CyberDogConfig = CyberDogConfig()


def default_data_folder(environment: Mapping[str, str]) -> Path:
    """The user's data folder as the XDG rules have it."""
    if explicit := environment.get("ROBOGLOT_DATA"):
        return Path(explicit)
    share = environment.get("XDG_DATA_HOME") or Path(environment.get("HOME", "/tmp")) / ".local" / "share"
    return Path(share) / "roboglot"
