"""Claim: 8000 poses/s and 2000 scans/s of one core, p99 <= 10 ms on 32 connections, 0.75 of what bare uvicorn does.

The load comes from a separate process. "Of one core" is what the server did per second of its own processor time,
all its threads counted, less what its world takes without requests; bare uvicorn is asked in turns with it. p99 is
under that same load.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import multiprocessing
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import uvloop
from _claim import Claims
from _serving import cpu_seconds, idle_share, in_turns

from roboglot.testing.process import served

CONNECTIONS = 32
SECONDS = 3.0
ADDRESS = "127.0.0.71"
PORT = 1448
POSE = "/api/core/slam/v1/localization/pose"
SCAN = "/api/core/system/v1/laserscan"
HELLO = """
import sys, uvicorn
HEADERS = [(b"content-type", b"text/plain"), (b"content-length", b"5")]
async def hello(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": HEADERS})
    await send({"type": "http.response.body", "body": b"hello"})
uvicorn.run(hello, host="127.0.0.1", port=int(sys.argv[1]), loop="uvloop", http="httptools", lifespan="off",
            access_log=False, log_level="error")
"""


@dataclass(frozen=True, slots=True)
class Load:
    """Result of one run of the load: answers, bytes of a body, and percentiles of the waiting times, ms."""

    answers: int
    seconds: float
    body: int
    p50: float
    p99: float


class Connection(asyncio.Protocol):
    """Asks again as soon as it is answered; every answer must be a 200."""

    def __init__(self, request: bytes, waited: list[float]) -> None:
        self._request, self._waited = request, waited
        self._left = 0
        self._sent = 0.0
        self.body = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        self._transport = transport
        self._ask()

    def _ask(self) -> None:
        self._sent = time.perf_counter()
        if not self._transport.is_closing():
            self._transport.write(self._request)

    def data_received(self, data: bytes) -> None:
        if not self._left:
            assert data.startswith(b"HTTP/1.1 200 OK"), data[:200]
            head, _, rest = data.partition(b"\r\n\r\n")
            self.body = int(head.lower().partition(b"content-length:")[2].partition(b"\r\n")[0])
            self._left = self.body - len(rest)
        else:
            self._left -= len(data)
        if not self._left:
            self._waited.append(time.perf_counter() - self._sent)
            self._ask()


async def ask(address: str, port: int, path: str, seconds: float) -> Load:
    """Ask for ``path`` on all connections, as fast as they are answered."""
    request = f"GET {path} HTTP/1.1\r\nHost: {address}\r\nAccept: application/json\r\n\r\n".encode()
    loop, waited = asyncio.get_running_loop(), list[float]()
    connections, began = [], time.perf_counter()
    for _ in range(CONNECTIONS):
        connections.append(await loop.create_connection(lambda: Connection(request, waited), address, port))  # noqa: PERF401 - one after the other
    await asyncio.sleep(seconds)
    spent = time.perf_counter() - began
    for transport, _ in connections:
        transport.abort()
    ordered = sorted(waited) or [spent]  # the machine was too busy to answer any
    p50, p99 = (1000 * ordered[int(len(ordered) * part)] for part in (0.5, 0.99))
    return Load(len(waited), spent, connections[0][1].body, p50, p99)


def load(*arguments: object) -> Load:
    """``ask`` in a separate process."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_ask, arguments)


def _ask(*arguments: object) -> Load:
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        return runner.run(ask(*arguments))  # type: ignore[arg-type]


def full_load(pid: int, idle: float, where: tuple[str, int, str], waits: list[float]) -> float:
    """Requests per second of the server's processor time; notes the ms that 99 of 100 of them took at most."""
    before, began = cpu_seconds(pid), time.perf_counter()
    done = load(*where, SECONDS)
    rate = done.answers / (cpu_seconds(pid) - before - idle * (time.perf_counter() - began))
    print(f"  {where[2]}: {done.answers / done.seconds:.0f}/s by the clock, {rate:.0f} per processor second", end=", ")
    print(f"bodies of {done.body} bytes, p50 {done.p50:.1f} ms, p99 {done.p99:.1f} ms", flush=True)
    waits.append(done.p99)
    return rate


@contextlib.contextmanager
def hello() -> Iterator[tuple[int, int]]:
    """Bare uvicorn: its process and port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with subprocess.Popen([sys.executable, "-c", HELLO, str(port)]) as process:
        try:
            for _ in range(100):
                with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
                    break
                time.sleep(0.1)
            yield process.pid, port
        finally:
            process.kill()


def main() -> None:
    claims, waits, others = Claims(), list[float](), list[float]()
    with (
        hello() as (pid, port),
        tempfile.TemporaryDirectory() as folder,
        served(Path(folder) / "data", address=ADDRESS) as robot,
    ):
        time.sleep(5)  # kernels are loaded
        with urllib.request.urlopen(f"http://{ADDRESS}:{PORT}{SCAN}") as answer:
            points = len(json.load(answer)["laser_points"])
        own = robot.process.pid
        idle = idle_share(own)
        pose, share = in_turns(
            lambda: full_load(pid, 0.0, ("127.0.0.1", port, "/"), others),
            lambda: full_load(own, idle, (ADDRESS, PORT, POSE), waits),
        )
        scan = full_load(own, idle, (ADDRESS, PORT, SCAN), others)
    claims.at_least("pose, of one core", pose, 8000, "requests/s")
    claims.at_least(f"laserscan, {points} points", scan, 2000, "requests/s")
    claims.at_least("pose / bare uvicorn's hello", share, 0.75, "")
    claims.at_most(f"pose, {CONNECTIONS} connections, p99", statistics.median(waits), 10, "ms")
    claims.finish()


if __name__ == "__main__":
    main()
