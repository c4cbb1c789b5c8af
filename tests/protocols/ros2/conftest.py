"""A robot in lockstep with the door, and a Zenoh client beside it that speaks rmw_zenoh's form by itself."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("zenoh", reason="needs roboglot[ros2]")
pytest.importorskip("rosbags", reason="needs roboglot[ros2]")

import zenoh
import zenoh.ext
from rosbags.typesys import Stores, get_typestore

from roboglot.model.clock import LockstepClock
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.protocols.lockstep import lockstep_runtime

ADDRESS, PORT = free_addresses(1), 7447
PATIENCE = 60.0  # real s
STORE = get_typestore(Stores.ROS2_JAZZY)


class Peer:
    """A ROS 2 node of its own making: keys, tokens, CDR."""

    def __init__(self, clock: LockstepClock) -> None:
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", f'["tcp/{ADDRESS}:{PORT}"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        self.clock, self.session = clock, zenoh.open(config)
        self.heard: dict[str, list[Any]] = {}
        self._subscribers: list[Any] = []
        self.attachments: dict[str, list[tuple[int, int, int, bytes]]] = {}  # by topic

    def close(self) -> None:
        self.session.close()

    def key(self, topic: str, type: str) -> str:
        package, kind, name = type.split("/")
        return f"0/{topic.strip('/')}/{package}::{kind}::dds_::{name}_/{STORE.hash_rihs01(type)}"

    def listen(self, topic: str, type: str, *, history: bool = False) -> None:
        found, attached = self.heard.setdefault(topic, []), self.attachments.setdefault(topic, [])

        def hear(sample: Any) -> None:
            attached.append(struct.unpack("<qqB16s", sample.attachment.to_bytes()))
            found.append(STORE.deserialize_cdr(sample.payload.to_bytes(), type))

        if history:
            past = zenoh.ext.HistoryConfig(detect_late_publishers=True)
            key = self.key(topic, type)
            self._subscribers.append(zenoh.ext.declare_advanced_subscriber(self.session, key, hear, history=past))
        else:
            self._subscribers.append(self.session.declare_subscriber(self.key(topic, type), hear))

    def publish(self, topic: str, type: str, message: Any) -> None:
        data = message if isinstance(message, bytes) else bytes(STORE.serialize_cdr(message, type))
        # By default Zenoh drops what a busy machine does not take at once: pieces of a long message.
        self.session.put(self.key(topic, type), data, congestion_control=zenoh.CongestionControl.BLOCK)

    def graph(self) -> list[list[str]]:
        """Return the known tokens, each cut at its slashes."""
        replies = self.session.liveliness().get("@ros2_lv/0/**")
        return [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]

    async def until(self, true: Callable[[], object], seconds: float = 0.0) -> None:
        """Wait until the condition holds; robot time passes too, at most ``seconds`` of it."""
        end = self.clock.time() + seconds
        async with asyncio.timeout(PATIENCE):
            while not true():
                if self.clock.time() < end:
                    await self.clock.advance(0.1)
                await asyncio.sleep(0.005)


class Scene:
    """One robot and its peer."""

    def __init__(self, runtime: Runtime, peer: Peer) -> None:
        self.runtime, self.peer = runtime, peer

    @property
    def robot(self) -> Any:
        return self.runtime.fleet.robots["a"]


Opened = Callable[..., Awaitable[Scene]]


@pytest.fixture
async def opened(tmp_path: Path) -> AsyncIterator[Opened]:
    """Open a robot; ``more``: further keys of its door's configuration."""
    scenes: list[Scene] = []

    async def open(**more: Any) -> Scene:
        runtime = await lockstep_runtime(tmp_path / "data", ADDRESS, "ros2", ros2={"enabled": True} | more)
        assert isinstance(runtime.clock, LockstepClock)
        scenes.append(Scene(runtime, await asyncio.to_thread(Peer, runtime.clock)))
        return scenes[-1]

    yield open
    for scene in scenes:
        await asyncio.to_thread(scene.peer.close)
        await scene.runtime.close()
