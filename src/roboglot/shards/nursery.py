"""The process from which every shard is forked: warmed up, single-threaded, without an event loop.

``python -m roboglot.shards.nursery DESCRIPTOR``: serves ``Fork`` and ``End`` on that socket, reports births and deaths,
and ends when the socket closes, its shards first. Shards die with it even if it is killed.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Callable
from functools import partial

import msgspec

from roboglot.shards.messages import MESSAGE_MAX, Birth, Born, Dead, End, Fork, NurseryRequest, Warm, encode
from roboglot.shards.warm_up import ENVIRONMENT, become, ended, fork, wake_at_ends, warm

LAST_SECONDS = 12.0  # s for shards to close when the nursery ends
LINK_FD = 3  # of a shard
OPEN_MAX = 1 << 16


class Nursery:
    """State of the fork server: its control socket, and its children by process id."""

    def __init__(self, control: socket.socket, run: Callable[[str, socket.socket], int]) -> None:
        self._control, self._run = control, run
        self._children: dict[int, int] = {}  # shard numbers by process
        self._wake = wake_at_ends()
        os.set_inheritable(control.fileno(), False)

    def serve(self) -> None:
        """Serve until the control socket closes."""
        poll = select.poll()
        poll.register(self._control, select.POLLIN)
        poll.register(self._wake, select.POLLIN)
        while True:
            ready = {descriptor for descriptor, _ in poll.poll()}
            if self._wake in ready:
                self._drain()
                self._report_deaths()
            if self._control.fileno() in ready and not self._answer():
                return

    def close(self) -> None:
        """End the shards: by SIGTERM, then by SIGKILL."""
        with contextlib.suppress(OSError):
            self._control.close()  # nothing is reported from here on
        for end, patience in ((signal.SIGTERM, LAST_SECONDS), (signal.SIGKILL, LAST_SECONDS)):
            for pid in self._children:
                os.kill(pid, end)
            deadline = time.monotonic() + patience
            while self._children and (left := deadline - time.monotonic()) > 0:
                select.select([self._wake], [], [], left)
                self._drain()
                self._reap()

    def _answer(self) -> bool:
        packet, descriptors, _, _ = socket.recv_fds(self._control, MESSAGE_MAX, 2)
        if not packet:
            return False
        match msgspec.json.decode(packet, type=NurseryRequest):
            case Fork(number=number, folder=folder):
                link, output = descriptors
                self._fork(number, folder, link, output)
                os.close(link)
                os.close(output)
            case End(number=number, signal=kind):
                for pid, child in self._children.items():
                    if child == number:
                        os.kill(pid, kind)  # ours and not reaped yet, so the number cannot have been reused
        return True

    def _fork(self, number: int, folder: str, link: int, output: int) -> None:
        pid = fork(take_signals)
        if pid == 0:
            become(partial(self._become_shard, folder, link, output))
        self._children[pid] = number
        self._send(Born(number, pid))

    def _become_shard(self, folder: str, link: int, output: int) -> int:
        """Run the shard, in the child; return its exit status."""
        _take_descriptors(link, output)
        return self._run(folder, socket.socket(fileno=LINK_FD))

    def _drain(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.read(self._wake, 4096)

    def _report_deaths(self) -> None:
        for number, status in self._reap():
            self._send(Dead(number, status))

    def _reap(self) -> list[tuple[int, int]]:
        dead = [(self._children.pop(pid, None), status) for pid, status in ended()]
        return [(number, status) for number, status in dead if number is not None]

    def _send(self, message: Birth) -> None:
        self._control.send(encode(message))


def take_signals() -> None:
    """Drop the nursery's handlers, in a child."""
    for kind in (signal.SIGCHLD, signal.SIGINT, signal.SIGTERM):
        signal.signal(kind, signal.SIG_DFL)


def _take_descriptors(link: int, output: int) -> None:
    """Move link and log to their numbers, and close everything else."""
    link, output = os.dup(link), os.dup(output)  # above the descriptors that are overwritten now
    os.dup2(output, 1)
    os.dup2(output, 2)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(link, LINK_FD, inheritable=False)
    close_above(LINK_FD)


def close_above(number: int) -> None:
    """Close all descriptors above ``number``."""
    os.closerange(number + 1, min(os.sysconf("SC_OPEN_MAX"), OPEN_MAX))


def serve(control: socket.socket, run: Callable[[str, socket.socket], int], loading: float) -> int:
    """Report that everything is loaded, serve until the socket closes, and end the shards; return the exit status."""
    nursery = Nursery(control, run)
    try:
        control.send(encode(Warm(loading, os.getpid())))
        nursery.serve()
    except (BrokenPipeError, ConnectionResetError):
        pass
    finally:
        nursery.close()
    return 0


def main(descriptor: int) -> None:
    """Warm up, report that, and serve on an inherited socket."""
    began = time.monotonic()
    for kind in (signal.SIGINT, signal.SIGTERM):  # sent to a whole group or unit: the supervisor's socket ends us
        signal.signal(kind, signal.SIG_IGN)
    control = socket.socket(fileno=descriptor)
    warm()
    from roboglot.shards.shard import run

    serve(control, run, time.monotonic() - began)


if __name__ == "__main__":
    os.environ |= ENVIRONMENT  # before numpy is imported
    main(int(sys.argv[1]))
