"""Greetings of both ends of a tunnel, as JSON: what the client asks for, and what the gateway opens to it."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Ports = Annotated[tuple[Annotated[int, Meta(ge=1, le=65535)], ...], Meta(max_length=64)]


class Hello(Struct, frozen=True, omit_defaults=True):
    """Greeting of a client: requests a robot, or a second connection for heartbeats (``beats``: the tunnel's key)."""

    robot: str = ""
    token: str = ""
    beats: str = ""


class Welcome(Struct, frozen=True):
    """Answer of the gateway: ports open to the client, and the key of a second connection."""

    tcp: Ports
    callbacks: Ports
    broadcasts: Ports
    beats: str = ""
