"""Delay that the recording proxy adds to an answer of each vendor's door, in turns: without it, with it, and through a
relay that only passes bytes.

Two figures: inside, from bytes received to bytes passed on, as the proxy itself measures it for every piece; and the
client's view, where the relay shows how much of it is one more process on this machine. A CyberDog is asked over TLS,
with certificates at both ends, and without. Robot, relays and client are separate processes, as they are in use;
the robot's time stands still, so that no simulated world is in the figures.
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
from roboglot.protocols.cyberdog.certificates import ensure_certificates, export_client
from roboglot.recording.lines import LINES, DogLine, Line, Target
from roboglot.testing.addresses import free_port

ROBOT, BETWEEN, BARE = "127.0.0.61", "127.0.0.62", "127.0.0.63"
RELAY = str(Path(__file__).parent.parent / "_bare_relay.py")
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
    """Return a line to a door of the robot, or of the proxy."""
    line = LINES[door](address, Target(f"{door}://{address}").port, RealClock(), lambda _operation, _data: None)
    if isinstance(line, DogLine):
        line.options = {"certs": certificates}
    await line.open()
    if door == "robomaster":
        await line.request("command", b"command;", [b"ok;"])
    return line


async def timed(line: Line, door: str) -> float:
    """Milliseconds of one request."""
    operation, payload = REQUESTS[door]
    if door == "visual":  # every front end gets all answers, and counts its own
        payload = payload.replace(b'"b"', b'"b%d"' % next(NUMBERS))
    began = time.perf_counter()
    assert await line.request(operation, payload, [b"{}"])
    return 1000.0 * (time.perf_counter() - began)


@contextlib.asynccontextmanager
async def running(ready: bytes, *words: str) -> AsyncIterator[list[str]]:
    """Python with these words, from the line that begins so until the end of ``async with``; then, its last lines."""
    program = await asyncio.create_subprocess_exec(
        sys.executable, *words, stdout=asyncio.subprocess.PIPE, stdin=asyncio.subprocess.PIPE
    )
    said: list[str] = []
    assert program.stdout is not None
    try:
        while not (line := await program.stdout.readline()).startswith(ready):
            assert line, "it ended"
        reading = asyncio.ensure_future(program.stdout.read())
        yield said
    finally:
        program.terminate()
        await program.wait()
    said += (await reading).decode().splitlines()


async def measure(door: str, robot: Robot, requests: int, claims: Claims) -> None:
    """Ask the robot, through the bare relay and through the proxy in turns."""
    dog = f"?certs={robot.certificates}&app={robot.called}" if door == "cyberdog" else ""
    has_tls = bool(dog) and robot.certificates != "none"
    file = robot.folder / f"{door}-{next(NUMBERS)}.mcap"
    words = ("record", f"{door}://{ROBOT}{dog}", "--listen", BETWEEN, "--to", str(file), "--data", str(robot.data))
    bare = (RELAY, BARE, str(Target(f"{door}://{ROBOT}").port), ROBOT, *([robot.certificates] if has_tls else []))
    places = (ROBOT, BARE, BETWEEN)
    async with running(BETWEEN.encode(), "-m", "roboglot", *words) as said, running(BARE.encode(), *bare):
        lines = [await opened(door, address, robot.certificates) for address in places]
        for line in lines:
            for _ in range(20):
                await timed(line, door)
        times: list[list[float]] = [[], [], []]
        for number in range(requests):
            for which in range(3):
                place = (number + which) % 3
                times[place].append(await timed(lines[place], door))
                await asyncio.sleep(PAUSE)
        for line in lines:
            await line.close()
    direct, relayed, passed = (statistics.median(one) for one in times)
    tails = [sorted(one)[round(0.99 * requests) - 1] for one in times]
    name = f"{door}{' with TLS' if has_tls else ''}"
    print(f"{name:20} median: direct {direct:.2f}, bare relay {relayed:.2f}, proxy {passed:.2f} ms;", end=" ")
    print("p99: direct {:.2f}, bare relay {:.2f}, proxy {:.2f} ms".format(*tails))
    (passing,) = (one for one in said if one.startswith("passing"))
    inside = [float(word) for word in passing.split() if word[0].isdigit() and "." in word]
    claims.at_most(f"{name}: inside, median", inside[0], ADDED_MAX, "ms")
    claims.at_most(f"{name}: inside, p99", inside[1], ADDED_MAX, "ms")
    claims.at_most(f"{name}: on the processor, p99", inside[3], ADDED_MAX, "ms")
    claims.at_most(f"{name}: client's view, median", passed - direct, ADDED_MAX, "ms")
    print(f"{'  of it more than the bare relay':36} {passed - relayed:9.2f} ms, p99 {tails[2] - tails[1]:.2f} ms")


async def robot_of(folder: Path, doors: Sequence[str], requests: int, claims: Claims, *, tls: bool) -> None:
    """Measure these doors of a robot."""
    called, data, file = free_port(), folder / f"data-{tls}", folder / f"{tls}.toml"
    file.write_text(
        f"world = 'empty'\n[console]\nenabled = false\n"
        f"[cyberdog]\nplaintext = {str(not tls).lower()}\napp_port = {called}\n"
    )
    words = ("up", "--lockstep", "--config", str(file), "--address", ROBOT, "--data", str(data))
    async with running(b"ready", "-m", "roboglot", *words):
        if tls:
            export_client(data / "cyberdog", folder / "certificates")
            own = ensure_certificates(data / "cyberdog")
            for name, value in (("robot.pem", own.certificate), ("robot.key", own.key)):
                (folder / "certificates" / name).write_bytes(value)
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
