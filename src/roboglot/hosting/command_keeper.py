"""Runs commands one after the other, and ends with all that they have started: even in other sessions and environments.

It is a program of its own (``python -m roboglot.hosting.command_keeper DESCRIPTOR MARK``), which adopts the orphans
of its commands, and which ends when the socket DESCRIPTOR closes, so also when its caller was killed. A request is the
length of a command, the command, and with it the descriptor that takes its output; the answer is its exit status.
"""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
from select import select

from roboglot.hosting.leftovers import MARK, adopt_orphans, end_descendants

LENGTH = struct.Struct("!I")
STATUS = struct.Struct("!i")
NOT_RUN = 126  # exit status, as a shell's


def received(link: socket.socket) -> tuple[str, int] | None:
    """Return the next command and the descriptor for its output; None at the end. Raises OSError."""
    head, outputs, _, _ = socket.recv_fds(link, LENGTH.size, 1)
    if len(head) < LENGTH.size or not outputs:
        return None
    (length,), command = LENGTH.unpack(head), b""
    while len(command) < length:
        if not (more := link.recv(length - len(command))):
            return None
        command += more
    return os.fsdecode(command), outputs[0]


def send(link: socket.socket, command: str, output: int) -> None:
    """Send a command with the descriptor for its output. Raises OSError."""
    packet = os.fsencode(command)
    socket.send_fds(link, [LENGTH.pack(len(packet))], [output])
    link.sendall(packet)


class _Children:
    """The children of this process, with a pipe that can be read when one has ended."""

    def __init__(self) -> None:
        self.ended, wakes = os.pipe()
        os.set_blocking(wakes, False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(wakes, warn_on_full_buffer=False)

    def reap(self, wanted: int) -> int | None:
        """Reap those that have ended; return the exit status of ``wanted``, if it is one of them."""
        found = None
        try:
            while (end := os.waitpid(-1, os.WNOHANG))[0]:
                if end[0] == wanted:
                    found = os.waitstatus_to_exitcode(end[1])
        except ChildProcessError:
            pass
        return found


def main(descriptor: str, mark: str) -> None:
    """Serve until the caller hangs up."""
    os.environ[MARK] = mark  # of the commands; this process must not be found by it: it ends them
    adopt_orphans()
    children = _Children()
    try:
        with socket.socket(fileno=int(descriptor)) as link:
            while (request := received(link)) is not None:
                if (status := _run(*request, link, children)) is None:
                    break
                link.sendall(STATUS.pack(status))
    except OSError:
        pass  # the caller has gone
    finally:
        end_descendants()


def _run(command: str, output: int, link: socket.socket, children: _Children) -> int | None:
    """Return the command's exit status; None if the caller hangs up before its end."""
    try:
        process = subprocess.Popen(
            command, shell=True, stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True
        )
    except (OSError, ValueError) as error:  # it is too long; it has a null byte
        os.write(output, f"{error}\n".encode())
        return NOT_RUN
    finally:
        os.close(output)
    status = process.returncode = children.reap(process.pid)
    while status is None:
        ready, _, _ = select([link.fileno(), children.ended], [], [])
        if link.fileno() in ready:
            return None
        os.read(children.ended, 1 << 10)
        status = process.returncode = children.reap(process.pid)
    return status


if __name__ == "__main__":
    main(*sys.argv[1:])
