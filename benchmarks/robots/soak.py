"""Claims: memory and descriptors are flat (± 5 %) over a long life, after its first tenth.

10,000 actions of all kinds through three doors, that succeed, fail, are replaced and called off; 1,000 connections;
1,000 block programs that end, fail, drive and are shut down; maps that are replaced. In lockstep, doors and clients in
one process, over real sockets. ``--share 0.1`` makes all of it a tenth as long.
"""

from __future__ import annotations

import argparse
import asyncio
import collections
import contextlib
import ctypes
import gc
import itertools
import json
import logging
import os
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import grpc
import httpx
from _claim import Claims

from roboglot.clients.visual import TextLink
from roboglot.config import Config, RobotConfig
from roboglot.model.actions import Action
from roboglot.model.clock import LockstepClock
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.runtime import Runtime
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service

ADDRESS = "127.0.0.86"
ACTIONS, CONNECTIONS, PROGRAMS, MAPS = 10_000, 1_000, 1_000, 50
PARTS = 10
TICK = 0.1  # s of the robot
ACTION_MAX = 1.0  # s of robot time for one action; the next one replaces it
GROWTH_MAX = 5.0  # %
REST = f"http://{ADDRESS}:1448"

SLAMWARE: list[tuple[str, dict[str, Any]]] = [
    ("MoveToAction", {"target": {"x": 1.0, "y": 0.0}, "move_options": {}}),
    ("MoveToAction", {"target": {"x": 12.0, "y": 0.0}, "move_options": {}}),  # behind the wall
    ("MoveToAction", {"target": {"x": 80.0, "y": 0.0}, "move_options": {}}),  # off the map
    ("MoveByAction", {"direction": 1, "duration": 300}),
    ("RotateAction", {"angle": 0.1}),
    ("SeriesMoveToAction", {"targets": [{"x": 0.3, "y": 0.0}, {"x": 0.0, "y": 0.0}], "move_options": {}}),
    ("RecoverLocalizationAction", {}),
    ("GoHomeAction", {"gohome_options": {"flags": "dock"}}),
    ("MoveToTagAction", {"target": {"x": 1, "y": 1}}),
    ("NoSuchAction", {}),
]
TEXTS = [
    "chassis move x -0.05",
    "chassis move z 10",
    "chassis move x 9",
    "chassis speed x 0.1",
    "gimbal move p 5",
    "hm",
]
DOG = [(1004, {"motion_id": 111}), (6004, {"type": 1, "goalX": 60.0, "goalY": 0.0}), (6009, {"type": 0}),
       (1002, {"motion_id": 303, "cmd_type": 1, "vel_des": [0.1, 0, 0]}), (1004, {"motion_id": 4242})]  # fmt: skip
BODIES = [
    "print('hello')",
    "print(1 / 0)",
    "cyberdog.motion.turn(5, 0.3)",
    "l = [str(i) for i in range(20000)]\nprint(len(l))",
    "while True:\n    time.sleep(1)",
    "cyberdog.motion.go_straight(99)\nraise ValueError('x' * 1000)",
]


class Life:
    """The robot, its clients, and what they have done so far."""

    def __init__(self, runtime: Runtime) -> None:
        self.clock = runtime.clock
        self.robot = runtime.fleet.robots["a"]
        self.web = httpx.AsyncClient(base_url=REST, timeout=60)
        self.done = collections.Counter[str]()
        self._ways = itertools.cycle(self._start())
        self._bodies = itertools.cycle(BODIES)
        self._numbers = itertools.count()
        self._ports = itertools.cycle((self._rest, self._text, self._dog, self._socket))
        self._seen: Action | None = None

    async def let_pass(self, work: Awaitable[Any]) -> Any:
        """Robot time goes on while ``work`` waits."""
        task = asyncio.ensure_future(work)
        while not task.done():
            assert isinstance(self.clock, LockstepClock)
            await self.clock.advance(TICK)
            await asyncio.sleep(0.001)
        return task.result()

    def _start(self) -> Iterator[Callable[[], Awaitable[object]]]:
        yield from (lambda n=n, o=o: self._act(n, o) for n, o in SLAMWARE)  # type: ignore[misc]
        yield from (lambda t=t: self._say(t) for t in TEXTS)  # type: ignore[misc]
        yield from (lambda c=c, p=p: self._ask(c, p) for c, p in DOG)  # type: ignore[misc]

    async def act(self) -> None:
        """One action by the next way, until it has ended or its time is over."""
        await self.let_pass(next(self._ways)())
        for _ in range(int(ACTION_MAX / TICK)):
            if not self.robot.actions.running():
                break
            await self.let_pass(asyncio.sleep(0))
        if self.robot.actions.history and (last := self.robot.actions.history[-1]) is not self._seen:
            self._seen = last
            self.done[last.status.name] += 1

    async def _act(self, name: str, options: dict[str, Any]) -> None:
        body = {"action_name": f"slamtec.agent.actions.{name}", "options": options}
        await self.web.post("/api/core/motion/v1/actions", json=body)

    async def _say(self, text: str) -> None:
        reader, writer = await asyncio.open_connection(ADDRESS, 40923)
        writer.write(f"command;{text};".encode())
        await reader.readuntil(b";")
        await reader.readuntil(b";")
        writer.close()

    async def _ask(self, code: int, params: dict[str, Any]) -> None:
        async with grpc.aio.insecure_channel(f"{ADDRESS}:50052") as channel:
            call = service.GrpcAppStub(channel).sendMsg(pb.SendRequest(nameCode=code, params=json.dumps(params)))
            async for _ in call:
                pass

    async def connect(self) -> None:
        """One connection by the next port, opened, used, closed."""
        await self.let_pass(next(self._ports)())

    async def _rest(self) -> None:
        async with httpx.AsyncClient(base_url=REST) as client:
            await client.get("/api/core/slam/v1/localization/pose")

    async def _text(self) -> None:
        await self._say("chassis position ?")

    async def _dog(self) -> None:
        await self._ask(10001, {})

    async def _socket(self) -> None:
        link = await TextLink.open(f"ws://{ADDRESS}:50053", "/log")
        await link.close()

    async def program(self) -> None:
        """Save, run, await, shut down and delete one."""
        await self.let_pass(self._program(f"p{next(self._numbers)}", next(self._bodies)))

    async def _program(self, name: str, body: str) -> None:
        link = await TextLink.open(f"ws://{ADDRESS}:50053", "/programs")
        frame = {"type": "task", "id": name, "target_id": [name], "mode": "single", "condition": "now"}
        await link.send(json.dumps({**frame, "operate": "save", "body": body}))
        await link.send(json.dumps({**frame, "operate": "run"}))
        async for text in link:
            said = json.loads(text).get("feedback", {})
            if said.get("operate") == "start" and "while True" in body:
                await link.send(json.dumps({**frame, "operate": "shutdown"}))
            elif said.get("operate") in ("stop", "shutdown") or said.get("state"):
                self.done[f"program {said.get('state')}"] += 1
                break
        await link.send(json.dumps({**frame, "operate": "delete"}))
        async for text in link:
            if json.loads(text).get("feedback", {}).get("operate") == "delete":
                break
        await link.close()

    async def new_map(self) -> None:
        """Take the map out, put it in again."""
        path = "/api/core/slam/v1/maps/stcm"
        kept = await self.let_pass(self.web.get(path))
        await self.let_pass(self.web.put(path, content=kept.content))
        await self.let_pass(self.web.post("/api/multi-floor/map/v1/stcm/:save"))


def objects() -> int:
    """Count the objects of this process, also those that a library's loading has set aside since."""
    gc.unfreeze()
    gc.collect()
    return len(gc.get_objects())


def measure() -> dict[str, float]:
    """Resident memory, objects and descriptors of this process, without what the C library keeps for later."""
    count = objects()
    ctypes.CDLL(None).malloc_trim(0)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return {
        "RSS, MB": pages * os.sysconf("SC_PAGE_SIZE") / 1e6,
        "objects": count,
        "descriptors": len(os.listdir("/proc/self/fd")),
    }


@contextlib.asynccontextmanager
async def born(data: Path) -> AsyncIterator[Life]:
    """Yield a robot with all its doors, in lockstep, and its clients."""
    config = Config(
        "empty",
        (RobotConfig("a", "universal", ADDRESS),),
        lockstep=True,
        data=data,
        doors={"cyberdog": CyberDogConfig(plaintext=True)},
    )
    runtime = Runtime(config)
    await runtime.start()
    life = Life(runtime)
    try:
        yield life
    finally:
        await life.web.aclose()
        await runtime.close()


async def live(share: float) -> list[dict[str, float]]:
    """Run it in ten parts and print the figures after each."""
    figures = []
    with tempfile.TemporaryDirectory() as data:
        async with born(Path(data)) as life:
            for part in range(PARTS):
                began = time.monotonic()
                for count, step in (
                    (ACTIONS, life.act),
                    (CONNECTIONS, life.connect),
                    (PROGRAMS, life.program),
                    (MAPS, life.new_map),
                ):
                    for _ in range(max(1, int(count * share / PARTS))):
                        await step()
                figures.append(measure())
                found = ", ".join(f"{name} {value:,.0f}" for name, value in figures[-1].items())
                print(f"part {part + 1}: {found}; {time.monotonic() - began:.0f} s; {dict(life.done)}", flush=True)
    return figures


def main() -> None:
    logging.disable(logging.WARNING)  # refusals are expected
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0)
    figures = asyncio.run(live(parser.parse_args().share))
    claims = Claims()
    for name in figures[0]:
        first, most = figures[0][name], max(each[name] for each in figures[1:])
        claims.at_most(f"{name}, growth after a tenth", 100 * (most / first - 1), GROWTH_MAX, "%")
    claims.finish()


if __name__ == "__main__":
    main()
