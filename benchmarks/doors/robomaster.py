"""Claim: >= 8000 round trips/s on one connection; 50 Hz pushes to five clients jitter by <= 5 ms (99th percentile)."""

from __future__ import annotations

import select
import socket
import tempfile
import time
from pathlib import Path

from _claim import Claims

from roboglot.testing.process import served

SECONDS = 10.0
ADDRESS = "127.0.0.71"
CLIENTS = [f"127.0.0.{number}" for number in range(201, 206)]  # the clients' port
PUSH_PORT = 40924


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


def main() -> None:
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder, served(Path(folder) / "data", address=ADDRESS) as robot:
        time.sleep(5)  # kernels are loaded
        connection = connect(robot.address, "127.0.0.1")
        for command in (b"robot mode ?;", b"chassis speed x 0 y 0 z 0;"):
            claims.at_least(f"round trips, {command.decode()}", round_trips(connection, command), 8000, "/s")
        connection.close()
        claims.at_most("50 Hz push, five clients, p99", jitter(robot.address), 5.0, "ms")
    claims.finish()


if __name__ == "__main__":
    main()
