"""Messages between supervisor, nursery and shards: one JSON object per packet, on sockets that preserve packets."""

from __future__ import annotations

import socket

import msgspec

MESSAGE_MAX = 1 << 17  # bytes; the endpoints of a hundred robots take 60 kB


class Fork(msgspec.Struct, tag=True, frozen=True):
    """Message to the nursery, with two descriptors (link and log): fork a shard with the settings in ``folder``."""

    number: int
    folder: str


class End(msgspec.Struct, tag=True, frozen=True):
    """Message to the nursery: send ``signal`` to this child if it is still alive."""

    number: int
    signal: int


class Warm(msgspec.Struct, tag=True, frozen=True):
    """Message of the nursery: everything is loaded, ``seconds`` after it was started. ``pid``: its process."""

    seconds: float
    pid: int = 0


class Born(msgspec.Struct, tag=True, frozen=True):
    """Message of the nursery: a shard was forked."""

    number: int
    pid: int


class Dead(msgspec.Struct, tag=True, frozen=True):
    """Message of the nursery: a child ended; ``status`` is the exit code, negative for a signal."""

    number: int
    status: int


class Ready(msgspec.Struct, tag=True, frozen=True):
    """Message of a shard: its doors answer. ("label", "address") of each robot's doors; the console's URL or ""."""

    endpoints: dict[str, list[tuple[str, str]]]
    console: str = ""


class Beat(msgspec.Struct, tag=True, frozen=True):
    """Message of a shard, once a second. ``factor``: robot time over wanted robot time of the last seconds.

    ``memory``: proportional set size (bytes); ``cpu``: processor time used so far (s).
    """

    factor: float
    memory: int
    cpu: float


class Refusal(msgspec.Struct, tag=True, frozen=True):
    """Message of a shard: why it cannot start. ``lasting``: its settings are wrong, so another try would fail, too."""

    reason: str
    lasting: bool


NurseryRequest = Fork | End
Birth = Warm | Born | Dead
News = Ready | Beat | Refusal


def pair() -> tuple[socket.socket, socket.socket]:
    """Return two connected sockets that preserve packets of up to ``MESSAGE_MAX`` bytes."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for end in (ours, theirs):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 2 * MESSAGE_MAX)
    return ours, theirs


def encode(message: NurseryRequest | Birth | News) -> bytes:
    """Return the packet of a message. Raises ValueError if it is too long."""
    packet = msgspec.json.encode(message)
    if len(packet) > MESSAGE_MAX:
        raise ValueError(f"a message of {len(packet)} bytes is longer than {MESSAGE_MAX}")
    return packet
