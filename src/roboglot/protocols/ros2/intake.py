"""Queue of messages: received in Zenoh's threads, answered in the event loop."""

from __future__ import annotations

import struct
import threading
from collections import defaultdict, deque
from collections.abc import Callable
from itertools import count

CDR_HEADER = 4  # bytes; the second says the order of the others
TWIST = {0: struct.Struct(">6d"), 1: struct.Struct("<6d")}  # by order
VELOCITY = "cmd_vel"


class Intake:
    """Messages in their order. Of a topic whose queue is full, the oldest makes room for a new one.

    Of velocities only the newest counts: each replaces the one before.
    """

    def __init__(self, most: int, drop: Callable[[str], None]) -> None:
        """``most``: messages of a topic; ``drop`` is called with a topic whose oldest made room, in any thread."""
        self._most, self._drop = most, drop
        self._lock = threading.Lock()
        self._numbers = count()
        self._heard: dict[int, tuple[str, bytes | None]] = {}  # in their order
        self._waiting = defaultdict[str, deque[int]](deque)

    def __len__(self) -> int:
        return len(self._heard)

    def put(self, key: str, data: bytes | None) -> None:
        """Add a message, in any thread. None stands for one that was too long."""
        with self._lock:
            waiting = self._waiting[key]
            full = len(waiting) >= (1 if key == VELOCITY else self._most)
            if full:
                del self._heard[waiting.popleft()]
            number = next(self._numbers)
            waiting.append(number)
            self._heard[number] = key, data
        if full and key != VELOCITY:
            self._drop(key)

    def pop(self) -> tuple[str, bytes | None]:
        """Remove and return the oldest message."""
        with self._lock:
            key, data = self._heard.pop(next(iter(self._heard)))
            self._waiting[key].popleft()
        return key, data

    def stops(self) -> bool:
        """Return whether a velocity of zero is queued."""
        with self._lock:
            return any(_stops(key, data) for key, data in self._heard.values())


def _stops(key: str, data: bytes | None) -> bool:
    if key != VELOCITY or data is None:
        return False
    try:
        return not any(TWIST[data[1]].unpack_from(data, CDR_HEADER))
    except (IndexError, KeyError, struct.error):
        return False
