"""Frames on a worker's socket: four bytes of length, big-endian, then JSON in UTF-8. Used at both ends.

Knows no message.
"""

from __future__ import annotations

FRAME_MAX = 1024 * 1024
"""Most bytes of a frame from a worker; a longer frame ends its run."""
HEADER = 4
CONTROL_MAX = 4096
"""Bytes of one message between server and zygote."""
ERROR_MAX = 2000
"""Most characters of an error's text."""


class FrameTooLong(ValueError):
    """The length of a frame is above the limit; no byte after it can be trusted."""


def frame(body: bytes) -> bytes:
    """Return the frame of a body."""
    return len(body).to_bytes(HEADER, "big") + body


class FrameReader:
    """Cuts a byte stream into bodies. Holds at most one frame and the last piece."""

    __slots__ = ("_limit", "_pending")

    def __init__(self, limit: int = FRAME_MAX) -> None:
        self._limit = limit
        self._pending = bytearray()

    def whole(self, data: bytes) -> bytes | None:
        """Return the body of a piece that is one whole frame, which is usual; None for others: ``feed`` takes them."""
        size = len(data) - HEADER
        if self._pending or size > self._limit or size < 0 or int.from_bytes(data[:HEADER], "big") != size:
            return None
        return data[HEADER:]

    def feed(self, data: bytes) -> list[bytes]:
        """Return the bodies completed by this piece. Raises FrameTooLong as soon as a header exceeds the limit."""
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
