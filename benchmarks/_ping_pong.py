"""The floor under a host call: two processes that exchange as many bytes over the same kind of socket.

One on the running loop, one blocking, as server and worker are; neither parses what it reads.
"""

from __future__ import annotations

import asyncio
import os
import socket
import time
from typing import cast

QUESTION, ANSWER = bytes(82), bytes(30)  # a call of ``turn`` with two numbers, and None
RUNS, CALLS = 20, 900


class _Host(asyncio.Protocol):
    def __init__(self, pid: int) -> None:
        self.count = 0
        self.began = self.ended = (0.0, 0.0)
        self.over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._pid = pid

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, _data: bytes) -> None:
        self.count += 1
        if self.count == 1:
            self.began = self._now()
        elif self.count == CALLS:
            self.ended = self._now()
            self._transport.abort()
            return
        self._transport.write(ANSWER)

    def connection_lost(self, _exc: Exception | None) -> None:
        self.over.set_result(None)

    def _now(self) -> tuple[float, float]:
        """Wall-clock time, and processor time of both (s)."""
        with open(f"/proc/{self._pid}/schedstat") as file:
            return time.perf_counter(), time.thread_time() + int(file.read().split()[0]) / 1e9


async def floor() -> tuple[float, float]:
    """Seconds of a question and its answer: by the wall, the best stretch; processor time of both, on average."""
    walls, spent = [], []
    for _ in range(RUNS):
        ours, theirs = socket.socketpair()
        pid = os.fork()
        if pid == 0:
            ours.close()
            _ask(theirs.fileno())
        theirs.close()
        ours.setblocking(False)
        host = _Host(pid)
        await asyncio.get_running_loop().create_unix_connection(lambda host=host: host, sock=ours)  # type: ignore[misc]
        await host.over
        os.waitpid(pid, 0)  # noqa: ASYNC222 - its socket has ended, and so has it
        walls.append((host.ended[0] - host.began[0]) / (CALLS - 1))
        spent.append((host.ended[1] - host.began[1]) / (CALLS - 1))
    return min(walls), sum(spent) / RUNS


def _ask(descriptor: int) -> None:
    try:
        while True:
            os.write(descriptor, QUESTION)
            if not os.read(descriptor, 65536):
                break
    finally:
        os._exit(0)
