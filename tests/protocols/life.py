"""A program in lockstep with the robot "a" behind the vendors' doors, and a client of each of three doors."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, TypeVar

import httpx

from roboglot.model.clock import LockstepClock
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.visual.server import VisualDoor
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.protocols.cyberdog.phone import Client, Messages, Pems

ADDRESS = free_addresses(1)
BODIES = ["hermes", "universal", "robomaster_ep", "cyberdog2"]
LIMIT = 60.0  # s of robot time that an answer may take
Answer = TypeVar("Answer")


class Life:
    """The program from a start to its end, and a client of each of three doors."""

    def __init__(self, runtime: Runtime, data: Path, messages: Messages) -> None:
        assert isinstance(runtime.clock, LockstepClock)
        self.runtime, self._clock = runtime, runtime.clock
        self.look: Callable[[], None] = lambda: None  # at the world, whenever time has passed
        self._http = httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", timeout=60, verify=False)
        pems = Pems(*(path.read_bytes() for path in export_client(data / "cyberdog", data / "phone")))
        self._channel = pems.channel(50052, address=ADDRESS)
        self.phone = Client(self._channel, messages)
        self._visual = next(door for door in runtime.doors["a"]._doors if isinstance(door, VisualDoor))

    async def forward(self, seconds: float) -> None:
        await self._clock.advance(seconds)
        self.look()

    async def during(self, request: Awaitable[Answer]) -> Answer:
        """Let time pass until there is an answer."""
        task, passed = asyncio.ensure_future(request), 0.0
        while not (await asyncio.wait((task,), timeout=0.004))[0]:
            if passed < LIMIT:
                await self.forward(0.1)
                passed += 0.1
        return task.result()

    async def rest(self, method: str, url: str, **content: Any) -> httpx.Response:
        return await self.during(self._http.request(method, url, **content))

    async def dog(self, code: int, params: dict[str, Any]) -> object:
        return [data for _, data in await self.during(self.phone.raw(code, params))]

    async def visual(self, words: dict[str, Any]) -> object:
        return await self.during(self.visual_now(words))

    async def visual_now(self, words: dict[str, Any]) -> list[Any]:
        """Ask what takes no robot time."""
        frames: list[Any] = []
        stop = self._visual.subscribe(lambda text: frames.append(json.loads(text)))
        await self._visual.receive(json.dumps({"id": "q"} | words))
        stop()
        answers = [frame.get("feedback") or frame.get("response") or {} for frame in frames]
        return [answer for answer in answers if answer.get("id") == "q"]

    async def close(self) -> None:
        await self._http.aclose()
        await self._channel.close()
        await self.runtime.close()
