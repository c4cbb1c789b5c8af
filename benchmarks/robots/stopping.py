"""Claim: `roboglot stop --all` has 100 robots stand in <= 0.5 s.

All drive by the text SDK. Timed is the command's request to a running `roboglot up`, until the answer that all stand.
Reference: a status request over the same socket, which waits for the program's own work.

    scripts/bench stopping [--robots 100] [--times 5]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import statistics
import tempfile
import time
from pathlib import Path

from _claim import Claims

from roboglot.control.lease_server import NAME
from roboglot.hosting.local_socket import ask
from roboglot.testing.process import served

FIRST = "127.34.0.1"
PATIENCE = 60.0  # s
PAUSE = 1.5  # s of driving
TEXT_PORT = 40923


def options(robots: int) -> list[str]:
    """Return the options of ``roboglot up`` for so many robots with all doors, without pages."""
    return ["--no-console", *(word for n in range(1, robots) for word in ("--robot", f"r{n}=universal"))]


async def connect(robots: int) -> list[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """Return a client of the text SDK for each robot."""
    links = [await asyncio.open_connection(f"127.34.0.{n + 1}", TEXT_PORT) for n in range(robots)]
    for reader, writer in links:
        writer.write(b"command;")
        await reader.readuntil(b";")
    return links


async def timed(socket: Path, wish: bytes) -> tuple[float, bytes]:
    """Return how long a wish took, s, and the answer."""
    began = time.monotonic()
    answer = await ask(socket, wish, PATIENCE)
    return time.monotonic() - began, answer


async def measure(socket: Path, robots: int, times: int) -> tuple[list[float], list[float]]:
    """Drive all and stop all, so many times: s of each look and of each stop. Raises AssertionError."""
    links, looks, stops = await connect(robots), list[float](), list[float]()
    for number in range(times):
        for _, writer in links:  # forth and back, or some would meet others
            writer.write(b"chassis speed x 0.1 y 0 z 20;" if number % 2 == 0 else b"chassis speed x -0.1 y 0 z -20;")
        for reader, _ in links:
            assert await reader.readuntil(b";") == b"ok;"
        await asyncio.sleep(PAUSE)
        seconds, answer = await timed(socket, b'{"do": "look"}')
        idle = [row["robot"] for row in json.loads(answer)["robots"] if not row["holder"]]
        assert not idle, f"these do not drive: {idle}"
        looks.append(seconds)
        seconds, answer = await timed(socket, b'{"do": "stop", "all": true}')
        assert b'"error":""' in answer, answer[-200:]
        assert answer.count(b'"holder":""') == robots, "not all stand"
        stops.append(seconds)
    for _, writer in links:
        writer.close()
    return looks, stops


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=100)
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--settle", type=float, default=20.0, help="s until every robot can map and navigate")
    chosen, claims = parser.parse_args(), Claims()
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        with served(data, *options(chosen.robots), address=FIRST) as robot:
            time.sleep(chosen.settle)
            looks, stops = asyncio.run(measure(data / NAME, chosen.robots, chosen.times))
            print(f"{chosen.robots} robots, {robot.resident_megabytes:.0f} MB, load {os.getloadavg()[0]:.1f}")
    print(f"reference: to ask how they are takes {statistics.median(looks):.2f} s, at most {max(looks):.2f}")
    claims.at_most("stop --all, median", statistics.median(stops), 0.5, "s")
    claims.at_most("stop --all, at most", max(stops), 0.5, "s")
    claims.finish()


if __name__ == "__main__":
    main()
