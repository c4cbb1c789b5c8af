"""The nursery of a machine: one warmed process, from which each supervisor that connects has its shards forked.

``python -m roboglot.shards.node_nursery LISTENING OWNER LOG``: loads, then forks a ``Nursery`` for each connection to
the inherited socket. It ends when none has been there for ``IDLE`` s, or when the descriptor OWNER, if that is not 0,
can be read, as that of a process that has ended. Shards end with their connection.
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

from roboglot.shards.node_client import user_of
from roboglot.shards.nursery import LINK_FD, close_above, serve, take_signals
from roboglot.shards.warm_up import become, ended, fork, wake_at_ends, warm

IDLE = 30.0  # s without a connection


class NodeNursery:
    """The listening socket, and the processes that serve connections."""

    def __init__(
        self, listening: socket.socket, owner: int, run: Callable[[str, socket.socket], int], loading: float
    ) -> None:
        """``owner``: can be read once this process has to end; 0: none. ``loading``: s that loading took."""
        self._owner, self._run, self._loading = owner, run, loading
        self._listening: socket.socket | None = listening
        self._children: set[int] = set()
        self._wake = wake_at_ends()
        listening.setblocking(False)

    def serve(self) -> None:
        """Serve until the owner has ended or nothing was to do for ``IDLE`` s, and the last connection with it."""
        poll = select.poll()
        watched = [self._wake, self._owner, self._listening.fileno() if self._listening else 0]
        for descriptor in filter(None, watched):
            poll.register(descriptor, select.POLLIN)
        while self._listening is not None or self._children:
            ready = {descriptor for descriptor, _ in poll.poll(None if self._children else IDLE * 1e3)}
            self._reap()
            if self._listening is None:
                continue
            self._accept(self._listening)
            if self._owner in ready or not (ready or self._children):
                poll = select.poll()
                poll.register(self._wake, select.POLLIN)
                self._stop_listening(self._listening)

    def _accept(self, listening: socket.socket) -> None:
        """Fork a nursery for each connection that waits."""
        with contextlib.suppress(BlockingIOError):
            while True:
                connection, _ = listening.accept()
                with connection:
                    if user_of(connection) == os.getuid():
                        self._fork(connection)

    def _fork(self, connection: socket.socket) -> None:
        try:
            pid = fork(take_signals)
        except OSError as error:  # there is no room for a process; the supervisor tries again
            sys.stderr.write(f"cannot serve a connection: {error}\n")
            return
        if pid == 0:
            become(partial(self._become_nursery, connection))
        self._children.add(pid)

    def _become_nursery(self, connection: socket.socket) -> int:
        """Serve one connection, in the child; that hangs up when this process ends, after its shards."""
        os.dup2(connection.fileno(), LINK_FD, inheritable=False)
        close_above(LINK_FD)
        for kind in (signal.SIGINT, signal.SIGTERM):
            signal.signal(kind, signal.SIG_IGN)
        control = socket.socket(fileno=os.dup(LINK_FD))
        control.setblocking(True)
        return serve(control, self._run, self._loading)

    def _reap(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.read(self._wake, 4096)
        self._children.difference_update(pid for pid, _ in ended())

    def _stop_listening(self, listening: socket.socket) -> None:
        """Remove the socket, then serve those that had connected before."""
        with contextlib.suppress(FileNotFoundError):
            os.unlink(listening.getsockname())
        self._accept(listening)
        listening.close()
        self._listening = None


def main(listening: int, owner: int, log: str) -> None:
    """Load in a process that outlives the caller's, and serve; leave the log only if that fails."""
    if os.fork():
        os._exit(0)
    began = time.monotonic()
    for kind in (signal.SIGINT, signal.SIGTERM):  # sent to a whole unit: connections and the owner end us
        signal.signal(kind, signal.SIG_IGN)
    warm()
    from roboglot.shards.shard import run

    NodeNursery(socket.socket(fileno=listening), owner, run, time.monotonic() - began).serve()
    with contextlib.suppress(OSError):
        os.unlink(log)  # the lock on it ends with this process


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
