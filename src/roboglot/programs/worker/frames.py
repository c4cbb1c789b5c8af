"""Frames on a worker's socket: four bytes of length, big-endian, then JSON in UTF-8. Both ends use it.

It knows no message.
"""

from __future__ import annotations

FRAME_MAX = 1024 * 1024
"""Bytes of one frame from a worker; a longer one ends its run."""
HEADER = 4


class FrameTooLong(ValueError):
    """The announced length is above the limit; nothing after it can be trusted."""


def frame(body: bytes) -> bytes:
    """The bytes to send for a body."""
    return len(body).to_bytes(HEADER, "big") + body


class FrameReader:
    """Cuts a byte stream into bodies. Holds at most one frame plus the piece fed last."""

    __slots__ = ("_limit", "_pending")

    def __init__(self, limit: int = FRAME_MAX) -> None:
        self._limit = limit
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """The bodies completed by this piece; raises FrameTooLong as soon as a header announces too much."""
        if not self._pending and len(data) == HEADER + int.from_bytes(data[:HEADER], "big") <= HEADER + self._limit:
            return [data[HEADER:]]  # one whole frame: the usual case
        self._pending += data
        bodies: list[bytes] = []
        start = 0
        while len(self._pending) - start >= HEADER:
            length = int.from_bytes(self._pending[start : start + HEADER], "big")
            if length > self._limit:
                raise FrameTooLong(f"a frame of {length} bytes, at most {self._limit} are allowed")
            end = start + HEADER + length
            if len(self._pending) < end:
                break
            bodies.append(bytes(self._pending[start + HEADER : end]))
            start = end
        del self._pending[:start]
        return bodies
