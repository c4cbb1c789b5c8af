"""Wake-ups of the event loop by gRPC, read as fast as they come. Knows nothing of calls.

A thread of gRPC's writes one byte into a socket for each of its events. gRPC's reader in the loop takes all events, but
only one byte. A busy loop with many calls falls behind with those, until the socket is full and that thread blocks:
from then on there is one event a turn of the loop, and each call waits for hundreds of others.
"""

from __future__ import annotations

import asyncio
import fcntl
import socket
import sys
import termios
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INT = 4  # bytes of the count that the kernel gives
_reading = threading.Lock()  # the loops of all threads read one socket


@contextmanager
def prompt_wakes() -> Iterator[None]:
    """Make servers and channels of ``grpc.aio`` within: the first in a loop has it read gRPC's socket."""
    loop = asyncio.get_running_loop()
    add_reader = loop.add_reader

    def add(wakes: socket.socket, wake: Callable[[], object], *values: object) -> None:
        assert not values
        add_reader(wakes, _take, wakes, wake)

    vars(loop)["add_reader"] = add
    try:
        yield
    finally:
        del vars(loop)["add_reader"]


def _take(wakes: socket.socket, wake: Callable[[], object]) -> None:
    """Read all bytes but the one that gRPC reads itself, then have it take the events, those of other loops, too.

    Two threads at once could read that one as well: then neither would take the events. A loop that comes too early is
    called again while there are bytes.
    """
    if not _reading.acquire(blocking=False):
        return
    try:
        count = int.from_bytes(fcntl.ioctl(wakes, termios.FIONREAD, bytes(INT)), sys.byteorder)
        if count > 1:
            wakes.recv(count - 1)
        if count:
            wake()
    finally:
        _reading.release()
