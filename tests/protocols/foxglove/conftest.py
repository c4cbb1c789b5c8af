"""A robot in lockstep with the door, and a client written from the protocol's description alone."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from roboglot.model.clock import LockstepClock
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.protocols.lockstep import lockstep_runtime

ADDRESS = free_addresses(1)
PORT = 8765
PATIENCE = 60.0  # real s


class Viewer:
    """Client like Foxglove's app: reads what the server has, subscribes, publishes."""

    def __init__(self, socket: ClientConnection, clock: LockstepClock) -> None:
        self.socket, self.clock = socket, clock
        self.said: dict[str, list[dict[str, Any]]] = {}
        self.data: dict[int, list[tuple[int, bytes]]] = {}
        self.times: list[int] = []
        self.binary: list[bytes] = []
        self.channels: dict[str, dict[str, Any]] = {}
        self._numbers = 0
        self._reading = asyncio.get_running_loop().create_task(self._read())

    async def _read(self) -> None:
        async for message in self.socket:
            if isinstance(message, str):
                value = json.loads(message)
                self.said.setdefault(value["op"], []).append(value)
                for channel in value.get("channels", ()):
                    self.channels[channel["topic"]] = channel
            elif message[0] == 1:
                _, subscription, at = struct.unpack_from("<BIQ", message)
                self.data.setdefault(subscription, []).append((at, message[13:]))
            elif message[0] == 2:
                self.times.append(struct.unpack("<BQ", message)[1])
            else:
                self.binary.append(message)

    async def close(self) -> None:
        self._reading.cancel()
        await self.socket.close()

    async def until(self, true: Callable[[], object], seconds: float = 0.0) -> None:
        """Wait until the condition holds; robot time passes too, at most ``seconds`` of it."""
        end = self.clock.time() + seconds
        async with asyncio.timeout(PATIENCE):
            while not true():
                if self.clock.time() < end:
                    await self.clock.advance(0.1)
                await asyncio.sleep(0.002)

    async def say(self, op: str, **values: Any) -> None:
        await self.socket.send(json.dumps({"op": op} | values))

    async def topic(self, name: str, seconds: float = 0.0) -> dict[str, Any]:
        await self.until(lambda: name in self.channels, seconds)
        return self.channels[name]

    async def subscribe(self, name: str) -> int:
        """Subscribe, and return the number under which messages come."""
        channel = await self.topic(name)
        self._numbers += 1
        await self.say("subscribe", subscriptions=[{"id": self._numbers, "channelId": channel["id"]}])
        return self._numbers

    async def advertise(self, topic: str, schema: str, number: int = 1, encoding: str = "json") -> None:
        channel = {"id": number, "topic": topic, "encoding": encoding, "schemaName": schema}
        await self.say("advertise", channels=[channel])

    async def publish(self, value: object, number: int = 1) -> None:
        data = value if isinstance(value, bytes) else json.dumps(value).encode()
        await self.socket.send(struct.pack("<BI", 1, number) + data)

    async def settled(self) -> None:
        """Return when all that was sent before has been answered."""
        name = f"settled {len(self.said.get('parameterValues', ()))}"
        await self.say("getParameters", parameterNames=["robot.name"], id=name)
        await self.until(lambda: any(row.get("id") == name for row in self.said.get("parameterValues", ())))

    @property
    def complaints(self) -> list[str]:
        return [row["message"] for row in self.said.get("status", ())]


class Scene:
    """One robot, and who looks at it."""

    def __init__(self, runtime: Runtime) -> None:
        self.runtime = runtime
        self._viewers: list[Viewer] = []

    @property
    def robot(self) -> Any:
        return self.runtime.fleet.robots["a"]

    @property
    def clock(self) -> LockstepClock:
        assert isinstance(self.runtime.clock, LockstepClock)
        return self.runtime.clock

    async def connect(self, *subprotocols: str, **more: Any) -> Viewer:
        names = [Subprotocol(name) for name in subprotocols or ("foxglove.sdk.v1",)]
        socket = await connect(f"ws://{ADDRESS}:{PORT}", subprotocols=names, max_size=None, **more)
        viewer = Viewer(socket, self.clock)
        self._viewers.append(viewer)
        return viewer

    async def get(self, path: str) -> int:
        """Ask the Slamware door; returns the status."""
        async with httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", verify=False) as client:
            return (await client.get(path)).status_code

    async def close(self) -> None:
        for viewer in self._viewers:
            await viewer.close()
        await self.runtime.close()


Opened = Callable[..., Awaitable[Scene]]


@pytest.fixture
async def opened(tmp_path: Path) -> AsyncIterator[Opened]:
    """Open a robot; ``more``: further keys of its configuration."""
    scenes: list[Scene] = []

    async def open(**more: Any) -> Scene:
        runtime = await lockstep_runtime(tmp_path / "data", ADDRESS, "foxglove", "slamware", **more)
        scenes.append(Scene(runtime))
        return scenes[-1]

    yield open
    for scene in scenes:
        await scene.close()


@pytest.fixture
async def scene(opened: Opened) -> Scene:
    """The usual one."""
    return await opened()
