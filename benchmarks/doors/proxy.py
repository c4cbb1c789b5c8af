"""What the recording proxy adds to an answer, by turns with and without it: Slamware, RoboMaster, programs, CyberDog.

scripts/bench proxy [requests]
"""

from __future__ import annotations

import asyncio
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

from _claim import Claims

from roboglot.config import ConsoleConfig, RobotConfig, load_config
from roboglot.model.clock import RealClock
from roboglot.protocols import sections
from roboglot.recording.lines import LINES, DogLine, Line, Target
from roboglot.recording.proxy.dog import DogRelay
from roboglot.recording.proxy.relay import Book, Relay
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_port

ROBOT, BETWEEN = "127.0.0.61", "127.0.0.62"
INQUIRY = {"type": "task", "id": "b", "target_id": [], "operate": "inquiry", "mode": "single", "condition": "now"}
REQUESTS = {
    "slamware": ("GET /api/core/slam/v1/localization/pose", b"GET /api/core/slam/v1/localization/pose\n\n"),
    "robomaster": ("chassis position ?", b"chassis position ?;"),
    "visual": ("task inquiry", json.dumps({**INQUIRY, "style": "", "describe": "", "body": ""}).encode()),
    "cyberdog": ("10001", b"{}"),
}
ADDED_MAX = 1.0  # ms
Ask = Callable[[], Awaitable[object]]


async def opened(door: str, address: str) -> Line:
    """A line to a door of the robot, or of the proxy."""
    line = LINES[door](address, Target(f"{door}://{address}").port, RealClock(), lambda _operation, _data: None)
    if isinstance(line, DogLine):
        line.options = {}
    await line.open()
    if door == "robomaster":
        await line.ask("command", b"command;", 1)
    return line


async def timed(line: Line, door: str) -> float:
    """Milliseconds of one request."""
    operation, payload = REQUESTS[door]
    began = time.perf_counter()
    assert await line.ask(operation, payload, 1)
    return 1000.0 * (time.perf_counter() - began)


async def measure(door: str, folder: Path, requests: int, called: int, claims: Claims) -> None:
    """Ask with and without the proxy in turns; it runs in this process, as all of them do."""
    target = Target(f"cyberdog://{ROBOT}?certs=none&app={called}" if door == "cyberdog" else f"{door}://{ROBOT}")
    book = Book(folder / f"{door}.mcap", target, "0")
    is_dog = door == "cyberdog"
    relay = DogRelay(target, BETWEEN, book, None, free_port()) if is_dog else Relay(target, BETWEEN, book)
    await relay.open()
    lines = [await opened(door, ROBOT), await opened(door, BETWEEN)]
    try:
        for line in lines:
            for _ in range(20):
                await timed(line, door)
        times: tuple[list[float], list[float]] = [], []
        for number in range(requests):
            for which in (number % 2, 1 - number % 2):
                times[which].append(await timed(lines[which], door))
    finally:
        for line in lines:
            await line.close()
        await relay.close()
        book.close()
    (plain, passed), at = times, round(0.99 * requests) - 1
    medians, tails = [statistics.median(one) for one in times], [sorted(one)[at] for one in (plain, passed)]
    print(f"{door:10} median {medians[0]:.2f} -> {medians[1]:.2f} ms, p99 {tails[0]:.2f} -> {tails[1]:.2f} ms")
    claims.at_most(f"{door}: the proxy adds, median", medians[1] - medians[0], ADDED_MAX, "ms")


async def main(requests: int) -> None:
    """One robot, four protocols."""
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        called = free_port()
        dog = {"plaintext": True, "app_port": called}
        base = load_config(None, {"data": folder, "world": "office", "cyberdog": dog}, sections())
        robots = (RobotConfig("a", "universal", ROBOT),)
        runtime = Runtime(replace(base, robots=robots, console=ConsoleConfig(enabled=False)))
        await runtime.start()
        try:
            for door in REQUESTS:
                await measure(door, Path(folder), requests, called, claims)
        finally:
            await runtime.close()
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main(*(int(word) for word in sys.argv[1:] or ("500",))))
