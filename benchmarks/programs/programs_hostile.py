"""Claim: 50 hostile programs of ten kinds delay other clients of the robot by at most 20 ms (p99), over any protocol.

The same requests are timed without programs and beside them: a pose over REST, the battery over plain text, a value
over gRPC, and an inquiry over the frames' WebSocket. The difference of the 99th percentiles counts: other
programs on the machine delay both. A timer of the same process runs beside them: its delay is time in which the client
itself had no processor. Then all programs are ended by one frame, and their
processes are waited for; and fifty that do nothing but compute are ended, as a pupil's teacher would.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import grpc
from _claim import Claims

from roboglot.clients.visual import TextLink
from roboglot.testing.process import ServedRobot, served
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service

ADDRESS = "127.0.0.186"
PROGRAMS, SECONDS, EVERY = 50, 15.0, 0.02
DELAY_MAX, DEAD_MAX, WAIT_MAX = 20.0, 100.0, 60.0  # ms, ms, s
GEAR = 8013  # a request that reads one value
POSE = f"GET /api/core/slam/v1/localization/pose HTTP/1.1\r\nHost: {ADDRESS}\r\n\r\n".encode()
KINDS = {
    "computes": "while True: pass",
    "prints": "while True: print('x' * 60)",
    "prints empty lines": "while True: print('\\n' * 100000, end='')",
    "asks the time": "while True: time.time()",
    "sends many values": (
        "l = [[] for i in range(49000)]\nwhile True:\n    try:\n        cyberdog.audio.instantly_play(l)\n"
        "    except TypeError:\n        pass"
    ),
    "sends too many values": (
        "l = [[] for i in range(340000)]\nwhile True:\n    try:\n        cyberdog.audio.instantly_play(l)\n"
        "    except (TypeError, ValueError):\n        pass"
    ),
    "sends long texts": "s = 'x, ' * 300000\nwhile True: cyberdog.audio.instantly_play(s)",
    "begins blocks": "n = 0\nwhile True:\n    cyberdog.task.block(str(n))\n    n += 1",
    "plays music": "cyberdog.audio.set_log(True)\nwhile True: cyberdog.audio.offline_instantly_play(6000)",
    "fills its memory": (
        "while True:\n    x = []\n    try:\n        while True: x.append(bytearray(1000))\n    except MemoryError:\n"
        "        pass"
    ),
}


class Line:
    """Connection with one request after another; records the time of each answer, s."""

    def __init__(self, name: str, ask: Callable[[], Awaitable[object]]) -> None:
        self.name = name
        self._ask = ask

    async def times(self) -> list[float]:
        took, end = [], time.perf_counter() + SECONDS
        async with asyncio.timeout(SECONDS + WAIT_MAX):
            while time.perf_counter() < end:
                began = time.perf_counter()
                await self._ask()
                took.append(time.perf_counter() - began)
                await asyncio.sleep(EVERY)
        return sorted(took)


class Frames:
    """The frames' WebSocket: news are read and forgotten, answers awaited."""

    def __init__(self, link: TextLink) -> None:
        self._link = link
        self._ids = itertools.count(1)
        self._waiting: dict[str, asyncio.Future[dict[str, Any]]] = {}
        self.ended: set[str] = set()
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        async for text in self._link:
            frame = json.loads(text)
            content = frame.get("feedback") or frame["response"]
            if content.get("operate") == "shutdown" and content["id"].startswith("task_"):
                self.ended.add(content["target_id"])
            if (waiting := self._waiting.pop(content["id"], None)) and not waiting.done():
                waiting.set_result(content)

    async def ask(self, operate: str, *targets: str, **fields: str) -> dict[str, Any]:
        id = f"f{next(self._ids)}"
        waiting = self._waiting[id] = asyncio.get_running_loop().create_future()
        frame = {"type": "task", "id": id, "operate": operate, "target_id": targets} | fields
        await self._link.send(json.dumps(frame))
        async with asyncio.timeout(WAIT_MAX):
            answer: dict[str, Any] = await waiting
        if answer.get("state"):
            raise RuntimeError(f"{operate} {targets}: {answer}")
        return answer

    async def start(self, id: str, body: str) -> None:
        await self.ask("save", id, mode="single", condition="now", body=body)
        await self.ask("run", id)


@asynccontextmanager
async def lines(frames: Frames) -> AsyncIterator[list[Line]]:
    rest_reader, rest_writer = await asyncio.open_connection(ADDRESS, 1448)
    text_reader, text_writer = await asyncio.open_connection(ADDRESS, 40923)

    async def pose() -> None:
        rest_writer.write(POSE)
        head = await rest_reader.readuntil(b"\r\n\r\n")
        await rest_reader.readexactly(int(head.lower().partition(b"content-length:")[2].split()[0]))

    async def text(command: bytes = b"robot battery ?;") -> None:
        text_writer.write(command)
        await text_reader.read(200)

    await text(b"command;")
    async with grpc.aio.insecure_channel(f"{ADDRESS}:50052") as channel:
        stub = service.GrpcAppStub(channel)

        async def value() -> None:
            async for _ in stub.sendMsg(pb.SendRequest(nameCode=GEAR, params="{}")):
                pass

        async def nothing() -> None:
            await asyncio.sleep(0.005)

        yield [
            Line("REST", pose),
            Line("text", text),
            Line("gRPC", value),
            Line("frames", lambda: frames.ask("inquiry", "p0")),
            Line("timer", nothing),
        ]
    rest_writer.close()
    text_writer.close()


def children(robot: ServedRobot) -> set[int]:
    """Return the processes of programs: grandchildren of the server, by way of the zygote."""
    parents: dict[int, list[int]] = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parents.setdefault(int((entry / "stat").read_text().rpartition(")")[2].split()[1]), []).append(
                int(entry.name)
            )
        except OSError:
            continue
    return {pid for zygote in parents.get(robot.process.pid, []) for pid in parents.get(zygote, [])}


def living(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


async def end_all(robot: ServedRobot, frames: Frames, ids: list[str]) -> float:
    """ms from one frame until the last of their processes is gone."""
    pids = children(robot)
    began = time.perf_counter()
    asking = asyncio.ensure_future(frames.ask("shutdown", *ids))
    while any(map(living, pids)):  # noqa: ASYNC110
        await asyncio.sleep(0.002)
    took = 1000 * (time.perf_counter() - began)
    await asking
    while not frames.ended.issuperset(ids):  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    frames.ended.clear()
    return took


async def measure(robot: ServedRobot, claims: Claims) -> None:
    link = await TextLink.open(f"ws://{ADDRESS}:50053", "/programs")
    frames = Frames(link)
    async with lines(frames) as asked:
        await asyncio.gather(*(line.times() for line in asked[:1]))  # warm-up is over
        alone = await asyncio.gather(*(line.times() for line in asked))
        ids = [f"p{number}" for number in range(PROGRAMS)]
        bodies = itertools.cycle(KINDS.values())
        for id, body in zip(ids, bodies, strict=False):
            await frames.start(id, body)
        spent = robot.cpu_seconds
        began = time.perf_counter()
        beside = await asyncio.gather(*(line.times() for line in asked))
        print(f"server: {(robot.cpu_seconds - spent) / (time.perf_counter() - began):.2f} of a processor")
        print(f"memory of the server: {robot.resident_megabytes:.0f} MB")
        for line, before, after in zip(asked, alone, beside, strict=True):
            words = [
                f"{1000 * times[int(len(times) * share)]:.1f}" for times in (before, after) for share in (0.5, 0.99)
            ]
            print(
                f"{line.name:8} p50 {words[0]}, p99 {words[1]} ms alone; {words[2]} and {words[3]} beside the programs"
            )
            if line.name != "timer":
                delay = after[int(len(after) * 0.99)] - before[int(len(before) * 0.99)]
                claims.at_most(f"p99 delay over {line.name}", max(0.1, 1000 * delay), DELAY_MAX, "ms")
        print(f"ten kinds, {PROGRAMS} programs ended in {await end_all(robot, frames, ids):.0f} ms")
        for id in ids:
            await frames.start(id, KINDS["computes"])
        claims.at_most("until 50 busy programs are dead", await end_all(robot, frames, ids), DEAD_MAX, "ms")
    await link.close()


def main() -> None:
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("--robot", "a=universal", "--world", "playground", "--plaintext")
        with served(Path(folder) / "data", *arguments, address=ADDRESS) as robot:
            time.sleep(10.0)  # kernels are loaded
            asyncio.run(measure(robot, claims))
    claims.finish()


if __name__ == "__main__":
    main()
