"""mosquitto as the broker, a fleet control that speaks MQTT by paho alone, and robots in lockstep between them."""

from __future__ import annotations

import asyncio
import json
import queue
import shutil
import socket
import subprocess
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from roboglot.config import load_config
from roboglot.model.clock import LockstepClock
from roboglot.protocols import DOORS, sections
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses, free_port
from tests.protocols.vda5050.orders import encoded

mqtt = pytest.importorskip("paho.mqtt.client", reason="needs paho-mqtt, which aiomqtt brings")
MOSQUITTO = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
PATIENCE = 60.0  # real s
ADDRESS = free_addresses(1)


def listening(port: int, address: str = ADDRESS) -> None:
    """Return when a broker answers there."""
    for _ in range(200):
        try:
            socket.create_connection((address, port), 0.1).close()
            return
        except OSError:
            time.sleep(0.05)


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """The port of a mosquitto of our own."""
    if MOSQUITTO is None:
        pytest.skip("needs mosquitto: apt-get install mosquitto")
    port = free_port()
    file = tmp_path_factory.mktemp("mosquitto") / "conf"
    file.write_text(f"listener {port} {ADDRESS}\nallow_anonymous true\n")
    process = subprocess.Popen([MOSQUITTO, "-c", str(file)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    listening(port)
    yield port
    process.terminate()
    process.wait()


class Control:
    """An independent fleet control: its own topics and messages, and no code of roboglot's."""

    def __init__(self, port: int, level: str) -> None:
        self.level = level
        self.heard: dict[str, list[dict[str, Any]]] = {}
        self._queue: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
        self._client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
        self._client.on_message = lambda _client, _data, message: self._queue.put((message.topic, message.payload))
        self._client.on_connect = lambda client, *_: client.subscribe(f"uagv/{level}/#", 1)
        self._client.connect(ADDRESS, port)
        self._client.loop_start()
        self.serial = ""

    def close(self) -> None:
        self._client.disconnect()  # first: the loop's thread ends with the connection; otherwise it sleeps for a second
        self._client.loop_stop()

    def hear(self) -> None:
        """Take in what has come."""
        while not self._queue.empty():
            topic, payload = self._queue.get()
            _, _, _, self.serial, name = topic.split("/")
            self.heard.setdefault(name, []).append(json.loads(payload))

    def send(self, name: str, message: dict[str, Any] | bytes, *, wait: bool = True, retain: bool = False) -> None:
        data = message if isinstance(message, bytes) else encoded(message)
        sent = self._client.publish(f"uagv/{self.level}/roboglot/{self.serial}/{name}", data, qos=1, retain=retain)
        if wait:
            sent.wait_for_publish(PATIENCE)

    @property
    def state(self) -> dict[str, Any]:
        return self.heard["state"][-1]

    @property
    def errors(self) -> list[str]:
        return [error["errorType"] for error in self.state["errors"]]


class Yard:
    """One robot in lockstep and its fleet control."""

    def __init__(self, runtime: Runtime, control: Control, clock: LockstepClock) -> None:
        self.runtime, self.control, self.clock = runtime, control, clock
        self._open: Runtime | None = runtime

    @property
    def robot(self) -> Any:
        return self.runtime.fleet.robots["a"]

    async def close(self) -> None:
        """Close the robot, once."""
        runtime, self._open = self._open, None
        if runtime is not None:
            await runtime.close()

    async def until(self, true: Callable[[], bool], seconds: float = 60.0) -> None:
        """Let robot time pass, at most ``seconds`` of it, until the condition holds; messages take real time."""
        end, real = self.clock.time() + seconds, time.monotonic() + PATIENCE
        while True:
            self.control.hear()
            if self.control.heard.get("state") and true():
                return
            late = self.clock.time() >= end
            assert not late or time.monotonic() < real, self.control.heard.get("state", ["nothing"])[-1]
            if not late:
                await self.clock.advance(0.2)
            await asyncio.sleep(0.005)


Opened = Callable[..., Awaitable[Yard]]


@pytest.fixture
async def yard(broker: int, tmp_path: Path) -> AsyncIterator[Opened]:
    """Open a robot: its fleet control's version, and what its configuration says beside."""
    opened: list[Yard] = []

    async def open(version: str = "3.0", port: int = broker, **more: Any) -> Yard:
        control = Control(port, {"3.0": "v3", "2.1": "v2"}[version])
        door = {"broker": f"{ADDRESS}:{port}", "version": version, "serials": {"a": tmp_path.name}}
        values = {
            "data": str(tmp_path / "data"),
            "world": "empty",
            "lockstep": True,
            "robots": [{"name": "a", "body": "universal", "address": ADDRESS}],
            "console": {"enabled": False},
            "vda5050": door,
        }
        runtime = Runtime(load_config(None, values | more, sections()), tuple(d for d in DOORS if d.name == "vda5050"))
        await runtime.start()
        clock = runtime.clock
        assert isinstance(clock, LockstepClock)
        made = Yard(runtime, control, clock)
        opened.append(made)
        await made.until(lambda: control.serial == tmp_path.name)
        return made

    yield open
    for made in opened:
        await made.close()
        made.control.close()
