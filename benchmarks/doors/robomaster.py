"""Claims: >= 8000 round trips/s on one connection, >= 0.8 of what a bare asyncio.Protocol does per processor second.

That one echoes on uvloop in a separate process and is asked in turns with the robot; both share a core with the
client, where a bare echo costs least: on two cores, waking each other costs more than twice as much. 50 Hz pushes to
five clients jitter by <= 5 ms (99th percentile).
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from _claim import Claims
from _serving import idle_share, in_turns, per_core_second

from roboglot.testing.process import served

SECONDS = 10.0
ADDRESS = "127.0.0.71"
CLIENTS = [f"127.0.0.{number}" for number in range(201, 206)]  # the clients' port
PUSH_PORT = 40924
TRIPS, ROUNDS = 1000, 25  # in a turn, turns
ECHO = """
import asyncio, uvloop
class Echo(asyncio.Protocol):
    def connection_made(self, transport):
        self.transport = transport
    def data_received(self, data):
        self.transport.write(data)
async def main():
    server = await asyncio.get_running_loop().create_server(Echo, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()
uvloop.run(main())
"""


def connect(robot: str, host: str) -> socket.socket:
    connection = socket.create_connection((robot, 40923), source_address=(host, 0))
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.sendall(b"command;")
    connection.recv(64)
    return connection


def round_trips(connection: socket.socket, command: bytes) -> float:
    """Round trips per second, one after the other."""
    count, start = 0, time.perf_counter()
    while (spent := time.perf_counter() - start) < SECONDS / 2:
        for _ in range(100):
            connection.sendall(command)
            connection.recv(512)
        count += 100
    return count / spent


@contextlib.contextmanager
def echo() -> Iterator[tuple[int, socket.socket]]:
    """Yield a process that answers and does nothing else, and a connection to it."""
    with subprocess.Popen([sys.executable, "-c", ECHO], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout
            with socket.create_connection(("127.0.0.1", int(process.stdout.readline()))) as connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                yield process.pid, connection
        finally:
            process.kill()


@contextlib.contextmanager
def on_one_core(*servers: int) -> Iterator[None]:
    """Let the main threads of these processes and of this one share a core."""
    before = os.sched_getaffinity(0)
    for pid in (0, *servers):
        os.sched_setaffinity(pid, {min(before)})
    try:
        yield
    finally:
        for pid in (0, *servers):
            os.sched_setaffinity(pid, before)


def trips(connection: socket.socket, command: bytes) -> int:
    """Some round trips, one after the other."""
    for _ in range(TRIPS):
        connection.sendall(command)
        connection.recv(512)
    return TRIPS


def jitter(robot: str) -> float:
    """ms that the 99th percentile of pushes is off the beat, over all clients."""
    clients = [connect(robot, host) for host in CLIENTS]
    inboxes = []
    for host in CLIENTS:
        inbox = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        inbox.bind((host, PUSH_PORT))
        inbox.setblocking(False)
        inboxes.append(inbox)
    clients[0].sendall(b"chassis push attitude on afreq 50;")
    clients[0].recv(64)
    times: list[list[float]] = [[] for _ in inboxes]
    end = time.perf_counter() + SECONDS
    while time.perf_counter() < end:
        for ready in select.select(inboxes, [], [], 0.1)[0]:
            ready.recv(2048)
            times[inboxes.index(ready)].append(time.perf_counter())
    off = []
    for stamps in times:
        beats = [stamp - index / 50 for index, stamp in enumerate(stamps)]
        middle = sorted(beats)[len(beats) // 2]
        off += [abs(beat - middle) for beat in beats]
    for connection in (*clients, *inboxes):
        connection.close()
    return sorted(off)[int(len(off) * 0.99)] * 1000


def share_of_bare(claims: Claims, own: int, connection: socket.socket) -> None:
    """By the processor time of the two servers."""
    idle, command = idle_share(own), b"robot mode ?;"
    with echo() as (pid, other), on_one_core(pid, own):
        _, share = in_turns(
            lambda: per_core_second(pid, 0.0, lambda: trips(other, command)),
            lambda: per_core_second(own, idle, lambda: trips(connection, command)),
            ROUNDS,
        )
    claims.at_least("share of a bare echo", share, 0.8, "")


def main() -> None:
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder, served(Path(folder) / "data", address=ADDRESS) as robot:
        time.sleep(5)  # kernels are loaded
        connection = connect(robot.address, "127.0.0.1")
        for command in (b"robot mode ?;", b"chassis speed x 0 y 0 z 0;"):
            claims.at_least(f"round trips, {command.decode()}", round_trips(connection, command), 8000, "/s")
        share_of_bare(claims, robot.process.pid, connection)
        connection.close()
        claims.at_most("50 Hz push, five clients, p99", jitter(robot.address), 5.0, "ms")
    claims.finish()


if __name__ == "__main__":
    main()
