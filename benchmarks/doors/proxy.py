"""Delay that the recording proxy adds to an answer of each vendor's door, in turns with and without it.

A CyberDog is asked over TLS, with certificates at both ends, and without. Robot, proxy and client are processes of
their own, as they are in use; the robot's time stands still, so that no simulated world is in the figures.
scripts/bench proxy [requests]
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from _claim import Claims

from roboglot.model.clock import RealClock
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.recording.lines import LINES, DogLine, Line, Target
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
NUMBERS = itertools.count()
PAUSE = 0.002  # s between two requests, so that some fall into the proxy's other work


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot that runs. ``called``: the port where it calls an app; ``certificates``: a folder with an app's, or none.

    ``data`` is its data folder, whose certificates the proxy shows, too.
    """

    folder: Path
    data: Path
    called: int
    certificates: str


async def opened(door: str, address: str, certificates: str) -> Line:
    """A line to a door of the robot, or of the proxy."""
    line = LINES[door](address, Target(f"{door}://{address}").port, RealClock(), lambda _operation, _data: None)
    if isinstance(line, DogLine):
        line.options = {"certs": certificates}
    await line.open()
    if door == "robomaster":
        await line.ask("command", b"command;", [b"ok;"])
    return line


async def timed(line: Line, door: str) -> float:
    """Milliseconds of one request."""
    operation, payload = REQUESTS[door]
    if door == "visual":  # every front end gets every answer; only its own count
        payload = payload.replace(b'"b"', b'"b%d"' % next(NUMBERS))
    began = time.perf_counter()
    assert await line.ask(operation, payload, [b"{}"])
    return 1000.0 * (time.perf_counter() - began)


@contextlib.asynccontextmanager
async def running(ready: bytes, *words: str) -> AsyncIterator[None]:
    """``roboglot`` with these words, from the line that begins so until the end of ``async with``."""
    program = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "roboglot", *words, stdout=asyncio.subprocess.PIPE, stdin=asyncio.subprocess.PIPE
    )
    assert program.stdout is not None
    try:
        while not (line := await program.stdout.readline()).startswith(ready):
            assert line, "it ended"
        reading = asyncio.ensure_future(program.stdout.read())
        yield
    finally:
        program.terminate()
        await program.wait()
    reading.cancel()


async def measure(door: str, robot: Robot, requests: int, claims: Claims) -> None:
    """Ask with and without the proxy in turns."""
    dog = f"?certs={robot.certificates}&app={robot.called}" if door == "cyberdog" else ""
    file = robot.folder / f"{door}-{next(NUMBERS)}.mcap"
    words = ("record", f"{door}://{ROBOT}{dog}", "--listen", BETWEEN, "--to", str(file), "--data", str(robot.data))
    async with running(BETWEEN.encode(), *words):
        lines = [await opened(door, address, robot.certificates) for address in (ROBOT, BETWEEN)]
        for line in lines:
            for _ in range(20):
                await timed(line, door)
        times: tuple[list[float], list[float]] = [], []
        for number in range(requests):
            for which in (number % 2, 1 - number % 2):
                times[which].append(await timed(lines[which], door))
                await asyncio.sleep(PAUSE)
        for line in lines:
            await line.close()
    medians = [statistics.median(one) for one in times]
    tails = [sorted(one)[round(0.99 * requests) - 1] for one in times]
    (plain, passed) = medians
    name = f"{door} without TLS" if dog and robot.certificates == "none" else door
    print(f"{name:20} median {plain:.2f} -> {passed:.2f} ms, p99 {tails[0]:.2f} -> {tails[1]:.2f} ms")
    claims.at_most(f"{name}: the proxy adds, median", passed - plain, ADDED_MAX, "ms")
    claims.at_most(f"{name}: the proxy adds, p99", tails[1] - tails[0], ADDED_MAX, "ms")


async def robot_of(folder: Path, doors: Sequence[str], requests: int, claims: Claims, *, tls: bool) -> None:
    """Measure these doors of a robot."""
    called, data, file = free_port(), folder / f"data-{tls}", folder / f"{tls}.toml"
    file.write_text(
        f"world = 'empty'\n[console]\nenabled = false\n"
        f"[cyberdog]\nplaintext = {str(not tls).lower()}\napp_port = {called}\n"
    )
    words = ("up", "--lockstep", "--config", str(file), "--address", ROBOT, "--data", str(data))
    async with running(b"ready", *words):
        if tls:
            export_client(data / "cyberdog", folder / "certificates")
        robot = Robot(folder, data, called, str(folder / "certificates") if tls else "none")
        for door in doors:
            await measure(door, robot, requests, claims)


async def main(requests: int) -> None:
    """Four protocols."""
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        await robot_of(Path(folder), tuple(REQUESTS), requests, claims, tls=True)
        await robot_of(Path(folder), ("cyberdog",), requests, claims, tls=False)
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main(*(int(word) for word in sys.argv[1:] or ("500",))))
