"""Settings of the gRPC door."""

from __future__ import annotations

import re
from typing import Literal

from roboglot.config import Port
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class CyberDogConfig:
    """gRPC door. ``app`` is "host:port" of the phone app to dial; empty: the peer of the last call at ``app_port``.

    ``profile``: where manual and real robots disagree, the door answers as the manual (``spec``) or as robots with
    the open-source firmware (``robot``). ``plaintext`` is for tests: no TLS, and only allowed on a loopback address.
    ``reflection`` is for tools.
    """

    port: Port = 50052
    app: str = ""
    app_port: Port = 8981
    profile: Literal["spec", "robot"] = "spec"
    plaintext: bool = False
    reflection: bool = False

    def __post_init__(self) -> None:
        if self.app and not re.fullmatch(r".+:\d{1,5}", self.app):
            raise ValueError(f"cyberdog.app is HOST:PORT, not {self.app!r}")
