"""Disconnects driven robots if this program hangs while its machine lives.

An EP keeps its last velocity until its connection ends. A separate process shares each connection and ends it when
the program falls silent; see watchdog_process.py. Real time only: in lockstep a program may rightly pause.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

log = logging.getLogger(__name__)

PATIENCE = 0.25  # s without a sign of life, while a robot is driven, before its connection is cut
PERIOD = 0.05  # s between two signs of life
SCRIPT = Path(__file__).with_name("watchdog_process.py")


class Watchdog:
    """Watchdog of one program; its process lives while there is a connection to watch."""

    def __init__(self) -> None:
        self._names = itertools.count(1)
        self._watched: dict[str, Callable[[], bool]] = {}
        self._line: socket.socket | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._driving: list[str] = []

    def watch(self, descriptor: int, drives: Callable[[], bool]) -> Callable[[], None]:
        """End the connection of ``descriptor`` if the program hangs while ``drives()``; return how to unwatch it."""
        name = str(next(self._names))
        try:
            line = self._line = self._line or _start()
            socket.send_fds(line, [f"+{name}".encode()], [descriptor])
        except OSError as error:
            log.warning("robomaster: cannot start the watchdog, an EP drives on if this program hangs: %s", error)
            self._end()
            return lambda: None
        self._watched[name] = drives
        if self._timer is None:
            self._beat()
        return lambda: self._forget(name)

    def _forget(self, name: str) -> None:
        if self._watched.pop(name, None) is not None:
            self._send(f"-{name}")
        if not self._watched:
            self._end()

    def _beat(self) -> None:
        """Send a sign of life while any robot is driven, and a last one afterwards."""
        driving = [name for name, drives in self._watched.items() if drives()]
        if driving or self._driving:
            self._send(f"*{' '.join(driving)}")
        self._driving = driving
        if self._line:
            self._timer = asyncio.get_running_loop().call_later(PERIOD, self._beat)

    def _send(self, message: str) -> None:
        try:
            if self._line:
                self._line.send(message.encode())
        except BlockingIOError:
            return  # the watchdog itself is stopped; only its protection is lost
        except OSError as error:
            log.warning("robomaster: watchdog died, an EP drives on if this program hangs: %s", error)
            self._watched.clear()
            self._end()

    def _end(self) -> None:
        if self._timer:
            self._timer.cancel()
        if self._line:
            self._line.close()
        self._timer = self._line = None


def _start() -> socket.socket:
    """Start the process in its own session and return its socket; it ends when the socket is closed."""
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    near.setblocking(False)
    with far:
        process = subprocess.Popen(
            [sys.executable, "-I", "-S", str(SCRIPT), str(PATIENCE)],
            stdin=far.fileno(),
            stdout=subprocess.DEVNULL,  # keeps the program's own pipes from staying open
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    threading.Thread(target=process.wait, name="watchdog's end", daemon=True).start()
    return near
