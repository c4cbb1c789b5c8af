"""The process that outlives a program which hangs: it hangs up on the robots that the program drives.

Run by watchdog.py as a script of its own, with the standard library alone and in a session of its own, so that what
stops the program (Ctrl-Z, a debugger, a full disk) does not stop this. Standard input is a socket on which the program
sends its connections and, while it drives, a sign of life.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys

MESSAGE_MAX = 1024  # bytes
CONNECTIONS_MAX = 64


def hang_up(connection: socket.socket) -> None:
    """End the connection for all processes that share it; the robot then stops what was commanded over it."""
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)
    connection.close()


def serve(program: socket.socket, patience: float) -> None:
    """Until the program is gone: each connection that it drives over ends with it, or after ``patience`` s of silence.

    Messages: ``+7`` with a descriptor (connection 7), ``-7`` (it is over), ``*7 9`` (alive, and driving over 7 and 9).
    """
    connections: dict[str, socket.socket] = {}
    driving: set[str] = set()
    while True:
        program.settimeout(patience if driving else None)
        try:
            message, descriptors, _, _ = socket.recv_fds(program, MESSAGE_MAX, 1)
        except TimeoutError:
            for name in driving & connections.keys():
                hang_up(connections.pop(name))
            driving = set()
            continue
        except OSError:
            message, descriptors = b"", []
        if not message:
            break
        kind, names = message[:1], message[1:].decode(errors="replace").split()
        if kind == b"+" and descriptors and len(connections) < CONNECTIONS_MAX:
            connections[names[0]] = socket.socket(fileno=descriptors.pop())
        elif kind == b"-" and names[0] in connections:
            connections.pop(names[0]).close()
        elif kind == b"*":
            driving = set(names)
        for unwanted in descriptors:
            os.close(unwanted)
    for connection in connections.values():
        hang_up(connection)


if __name__ == "__main__":
    with socket.socket(fileno=0) as standard_input:
        serve(standard_input, float(sys.argv[1]))
