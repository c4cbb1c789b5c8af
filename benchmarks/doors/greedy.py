"""Claim: one client that asks as fast as it can costs the others <= 20 ms at the 99th percentile.

Ten robots in one program, each asked for its pose over REST and its mode over text ten times a second; then two more
connections of a process of its own send requests without a pause, over REST and, a thousand at a time, over text.

    scripts/bench greedy [--robots 10] [--seconds 8]
"""

from __future__ import annotations

import argparse
import http.client
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from _claim import Claims

from roboglot.testing.process import served

ADDRESS = "127.0.97.1"
POSE = "/api/core/slam/v1/localization/pose"
MODE = b"robot mode ?;"
AT_ONCE = 1000
PERIOD = 0.1  # s


def ask(address: str, end: float, spent: list[float]) -> None:
    """Ask one robot ten times a second; append ms of each answer."""
    text = socket.create_connection((address, 40923), 20)
    text.sendall(b"command;")
    text.recv(64)
    rest = http.client.HTTPConnection(address, 1448, timeout=20)
    while (now := time.perf_counter()) < end:
        text.sendall(MODE)
        text.recv(64)
        between = time.perf_counter()
        rest.request("GET", POSE)
        rest.getresponse().read()
        spent += [1000 * (between - now), 1000 * (time.perf_counter() - between)]
        time.sleep(max(0.0, now + PERIOD - time.perf_counter()))


def others(count: int, seconds: float) -> float:
    """Return the 99th percentile of all robots' answers, in ms."""
    spent: list[float] = []
    base, end = ADDRESS.rpartition(".")[0], time.perf_counter() + seconds
    threads = [threading.Thread(target=ask, args=(f"{base}.{n + 1}", end, spent)) for n in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    spent.sort()
    print(f"  {len(spent)} answers, median {spent[len(spent) // 2]:.2f} ms, p99 {spent[int(0.99 * len(spent))]:.2f} ms")
    return spent[int(0.99 * len(spent))]


def greed(door: str) -> None:
    """Ask without a pause."""
    if door == "rest":
        rest = http.client.HTTPConnection(ADDRESS, 1448, timeout=20)
        while True:
            rest.request("GET", POSE)
            rest.getresponse().read()
    text = socket.create_connection((ADDRESS, 40923), 20)
    text.sendall(b"command;")
    text.recv(64)
    while True:
        text.sendall(MODE * AT_ONCE)
        left = AT_ONCE
        while left > 0:
            left -= text.recv(1 << 16).count(b";")


def main(count: int, seconds: float) -> None:
    claims = Claims()
    robots = [option for n in range(1, count) for option in ("--robot", f"r{n}=universal")]
    with (
        tempfile.TemporaryDirectory() as name,
        served(Path(name) / "data", "--no-console", *robots, address=ADDRESS) as robot,
    ):
        time.sleep(8)  # kernels are loaded
        usual = others(count, seconds)
        greedy = [subprocess.Popen([sys.executable, __file__, "--greed", door]) for door in ("rest", "text")]
        slowed = others(count, seconds)
        for process in greedy:
            process.kill()
            process.wait()
        named = (robot.data.with_name("data.log")).read_text().count("waits for others")
    print(f"{named} log lines on clients that waited")
    claims.at_most("p99 of others, more", max(slowed - usual, 0.01), 20.0, "ms")
    claims.finish()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--greed", choices=("rest", "text"))
    chosen = parser.parse_args()
    if chosen.greed:
        greed(chosen.greed)
    else:
        main(chosen.robots, chosen.seconds)
