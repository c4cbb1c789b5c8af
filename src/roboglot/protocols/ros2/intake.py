"""Messages that wait for their turn: heard in Zenoh's threads, answered in the event loop."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable

CDR_HEADER = 4  # bytes; the second says the order of the others
TWIST = {0: struct.Struct(">6d"), 1: struct.Struct("<6d")}  # by order


class Intake:
    """Messages in their order; as of a topic with a depth, the oldest make room for new ones."""

    def __init__(self, most: int, drop: Callable[[str], None]) -> None:
        """``drop`` is called with the topic of a message for which the oldest made room, in any thread."""
        self._drop = drop
        self._heard: deque[tuple[str, bytes | None]] = deque(maxlen=most)

    def __len__(self) -> int:
        return len(self._heard)

    def put(self, key: str, data: bytes | None) -> None:
        """Add a message, in any thread. None: it was too long to be kept."""
        if len(self._heard) == self._heard.maxlen:
            self._drop(key)
        self._heard.append((key, data))

    def pop(self) -> tuple[str, bytes | None]:
        """Return the oldest message, which waits no more."""
        return self._heard.popleft()

    def stops(self) -> bool:
        """Return whether a velocity of zero waits."""
        return any(_stops(key, data) for key, data in tuple(self._heard))


def _stops(key: str, data: bytes | None) -> bool:
    if key != "cmd_vel" or data is None:
        return False
    try:
        return not any(TWIST[data[1]].unpack_from(data, CDR_HEADER))
    except (IndexError, KeyError, struct.error):
        return False
