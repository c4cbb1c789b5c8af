"""Faster reading of gRPC's wake-ups in the event loop, by a patch of gRPC's reader. Knows no calls.

A thread of gRPC writes one byte into a socket for each event. gRPC's reader in the loop takes all events, but reads
only one byte. With many calls, a busy loop falls behind until the socket is full and the thread blocks: then there is
only one event per turn of the loop, and each call waits for hundreds of others.
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

INT = 4  # bytes of the kernel's count
CLOSED = "Event loop is closed"  # asyncio's words, and uvloop's
LOOKED_FOR = 8  # turns of the loop between two looks for more bytes, each of which costs as much as taking an event
_reading = threading.Lock()  # the loops of all threads read one socket


@contextmanager
def prompt_wakeups() -> Iterator[None]:
    """Patch the reader of gRPC's socket; create a loop's first server or channel of ``grpc.aio`` inside."""
    loop = asyncio.get_running_loop()
    add_reader = loop.add_reader

    def add(wakes: socket.socket, wake: Callable[[], object], *values: object) -> None:
        assert not values
        add_reader(wakes, _taker(wakes, wake))

    vars(loop)["add_reader"] = add
    try:
        yield
    finally:
        del vars(loop)["add_reader"]


def _taker(wakes: socket.socket, wake: Callable[[], object]) -> Callable[[], None]:
    """Return a function that lets gRPC take all events, also those of other loops.

    Now and then it reads all bytes whose events gRPC took then, beyond the one that gRPC reads itself. One thread at a
    time: two could together read all bytes, and one's events would stay. A loop that finds the lock taken is called
    again while there are bytes.

    gRPC raises at an event of a loop that was closed before its calls had ended, and leaves those behind it: their
    bytes are left, too, so that it is called again.
    """
    left = 1  # turns until the next look

    def take() -> None:
        nonlocal left
        if not _reading.acquire(blocking=False):
            return
        try:
            left -= 1
            surplus = 0
            if not left:
                left = LOOKED_FOR
                surplus = _count(wakes) - 1
            wake()
            if surplus > 0:
                wakes.recv(surplus)
        except BlockingIOError:  # another loop read the byte, and took the events
            pass
        except RuntimeError as error:
            if str(error) != CLOSED:
                raise
        finally:
            _reading.release()

    return take


def _count(wakes: socket.socket) -> int:
    """Return the number of bytes to read."""
    return int.from_bytes(fcntl.ioctl(wakes, termios.FIONREAD, bytes(INT)), sys.byteorder)
