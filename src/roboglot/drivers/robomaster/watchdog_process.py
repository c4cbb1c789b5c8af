"""Watchdog process: disconnects driven robots when the program hangs.

watchdog.py runs it as a separate script, with the standard library alone and in its own session, so that whatever
stops the program (Ctrl-Z, a debugger, a full disk) does not stop it. Standard input is a socket on which the program
sends its connections and, while it drives, a sign of life.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys

MESSAGE_MAX = 1024  # bytes
CONNECTIONS_MAX = 64


class Connections:
    """Open connections of the program by name, and the names of those that it drives over."""

    def __init__(self) -> None:
        self.open: dict[str, socket.socket] = {}
        self.driving: set[str] = set()

    def take(self, message: bytes, descriptors: list[int]) -> None:
        """Handle ``+7`` with a descriptor (connection 7), ``-7`` (closed) or ``*7 9`` (alive, driving over 7 and 9)."""
        kind, names = message[:1], message[1:].decode(errors="replace").split()
        if kind == b"+" and descriptors and len(self.open) < CONNECTIONS_MAX:
            self.open[names[0]] = socket.socket(fileno=descriptors.pop())
        elif kind == b"-" and names[0] in self.open:
            self.open.pop(names[0]).close()
        elif kind == b"*":
            self.driving = set(names)

    def hang_up(self, names: set[str]) -> None:
        """End these connections for all processes that share them; the robots then stop."""
        for name in names & self.open.keys():
            connection = self.open.pop(name)
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()
        self.driving = set()


def serve(program: socket.socket, patience: float) -> None:
    """Run until the program is gone. Ends each driven connection with it, or after ``patience`` s of silence."""
    watched = Connections()
    while True:
        program.settimeout(patience if watched.driving else None)
        try:
            message, descriptors, _, _ = socket.recv_fds(program, MESSAGE_MAX, 1)
        except TimeoutError:
            watched.hang_up(watched.driving)
            continue
        except OSError:
            message, descriptors = b"", []
        if not message:
            break
        watched.take(message, descriptors)
        for unwanted in descriptors:
            os.close(unwanted)
    watched.hang_up(set(watched.open))


if __name__ == "__main__":
    with socket.socket(fileno=0) as standard_input:
        serve(standard_input, float(sys.argv[1]))
