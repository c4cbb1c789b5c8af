"""Frames of a tunnel: a kind, a stream's number, and at most FRAME_MAX bytes."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import NamedTuple

FRAME_MAX = 0xFFFF  # bytes of one frame's payload
HEAD = struct.Struct("!BIH")
PORT = struct.Struct("!H")
CREDIT = struct.Struct("!I")


class FrameKind(IntEnum):
    """Kind of a frame."""

    HELLO = 1  # from the client: its identity and the requested robot; JSON
    WELCOME = 2  # from the gateway: its ports; JSON
    REFUSED = 3  # from the gateway: the reason; text
    OPEN = 4  # a new stream, to this port at the other end
    DATA = 5
    CREDIT = 6  # this many more bytes may be sent on the stream
    CLOSE = 7  # the stream has ended
    DATAGRAM = 8  # to this port at the client's end
    PING = 9
    EOF = 10  # no more data will be sent on the stream; the other end may still answer


class TunnelFrame(NamedTuple):
    """One frame."""

    kind: FrameKind
    stream: int
    payload: bytes


class BadFrame(ValueError):
    """Received bytes are not a frame; the tunnel ends."""


def encode(kind: FrameKind, stream: int = 0, payload: bytes = b"") -> bytes:
    """Return the frame's bytes; the payload has at most FRAME_MAX."""
    return HEAD.pack(kind, stream, len(payload)) + payload
