"""A network between app and robot that is slow, loses, or is silent: nothing acknowledged is lost, the app goes on."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.events import DiskLow
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from tests.drivers.link_proxy import Fault, Proxy
from tests.protocols.cyberdog.phone import ADDRESS, App, Client, Messages, Pems, Stream, context_of, state
from tests.protocols.cyberdog.test_upkeep import MD5, module

pytestmark = pytest.mark.world("empty", body="cyberdog2")
Passing = Callable[[Callable[[], object]], Awaitable[None]]
SMALL = module(fileSize=20_000_000)


@dataclass
class Afar:
    """An app that reaches the robot through a bad network, in both directions; ``near`` has a wire of its own."""

    client: Client
    near: Client
    app: App
    door: CyberDogDoor
    fault: Fault
    passing: Passing
    ways: tuple[Proxy, Proxy]

    async def ask(self, code: int, params: object = None) -> Any:
        """Return the answer; robot time passes meanwhile."""
        asking = asyncio.ensure_future(self.client.ask(code, params))
        await self.passing(asking.done)
        return asking.result()

    async def fall_silent(self) -> None:
        """Half-open: no one is notified, and the app is missed in the end."""
        self.fault.silent = True
        await self.passing(lambda: not context_of(self.door).app.connected)

    async def heal(self) -> None:
        """The network is back, with new connections, and so is the app."""
        self.fault.heal()
        for way in self.ways:
            way.cut()
        await self.near.ask(10001)
        await self.passing(lambda: context_of(self.door).app.connected)


@pytest.fixture
async def afar(
    robot: Robot, data: Path, app: App, pems: Pems, messages: Messages, passing: Passing, clock
) -> AsyncIterator[Afar]:
    fault = Fault()
    back = Proxy(clock, ("127.0.0.1", app.port), fault, back=True)
    await back.start()
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app=f"127.0.0.1:{back.port}"), data)
    await door.start()
    way = Proxy(clock, (ADDRESS, door.port), fault)
    await way.start()
    async with pems.channel(way.port, address="127.0.0.1") as channel, pems.channel(door.port) as direct:
        made = Afar(Client(channel, messages), Client(direct, messages), app, door, fault, passing, (way, back))
        await passing(lambda: context_of(door).app.connected)
        yield made
        fault.heal()
    for proxy in made.ways:
        await proxy.close()
    await door.close()


@pytest.mark.parametrize("bad", ["delay", "loss"])
async def test_slow_or_lossy_network_delays_and_loses_nothing(afar: Afar, robot: Robot, bad: str) -> None:
    afar.fault.delay, afar.fault.lossy = (0.3, False) if bad == "delay" else (0.05, True)
    stream = Stream(afar.client, 6004, {"type": 5})
    await afar.passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    await afar.passing(lambda: afar.app.of(6001) and afar.app.of(6005))
    assert await afar.ask(6009, {"type": 5, "map_name": "far"}) == {"result": 0}
    await afar.passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 0}
    assert list(await robot[MapLibrary].names()) == ["far"]
    assert context_of(afar.door).app.connected


async def test_silence_while_mapping(afar: Afar, robot: Robot) -> None:
    stream = Stream(afar.client, 6004, {"type": 5})
    await afar.passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    await afar.fall_silent()
    assert await state(afar.near) == 5  # the task goes on
    await afar.heal()
    await asyncio.gather(stream.reading, return_exceptions=True)
    joined = Stream(afar.client, 6010, {"type": 5})
    await afar.passing(lambda: 6 in joined.codes)
    assert joined.answers[0] == {"accepted": 1}
    assert await afar.ask(6009, {"type": 5, "map_name": "home"}) == {"result": 0}
    await afar.passing(lambda: joined.ended)
    assert list(await robot[MapLibrary].names()) == ["home"]


@pytest.mark.slow  # in short: test_silence_during_an_update
@pytest.mark.parametrize("slow", [False, True], ids=["soon", "written after the app is back"])
async def test_silence_while_a_file_is_sent(
    afar: Afar, robot: Robot, slow: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop = CameraFiles.stop

    async def stop_late(files: CameraFiles, *, at_once: bool = False) -> Path:
        await robot.clock.sleep(8.0 if slow else 0.0)
        return await stop(files, at_once=at_once)

    monkeypatch.setattr(CameraFiles, "stop", stop_late)
    files = context_of(afar.door).files
    for name in files.names():  # another test's network
        files.remove(files.path(name))
    robot[Camera].rate = 5.0
    assert await afar.ask(4002, {"command": 2}) == {"result": 0}
    afar.fault.silent = True
    fetching = asyncio.ensure_future(afar.client.file(4002, {"command": 3}))
    await afar.passing(lambda: not context_of(afar.door).app.connected)
    await afar.heal()
    await asyncio.gather(fetching, return_exceptions=True)
    await afar.passing(lambda: afar.app.of(4003))
    (name,) = afar.app.of(4003)[-1]["file_name"]
    chunks = asyncio.ensure_future(afar.client.file(4004, {"file_name": name}))
    await afar.passing(chunks.done)
    assert sum(len(chunk.buffer) for chunk in chunks.result()) == chunks.result()[0].file_size > 0


async def test_push_to_a_lost_app_spares_later_ones(afar: Afar, robot: Robot) -> None:
    low, silent_since = DiskLow(stamp=0.0, free=1), robot.clock.time()
    afar.fault.silent = True
    await afar.passing(lambda: robot.clock.time() > silent_since + 3.5)  # early enough to be awaited at the end
    assert context_of(afar.door).app.connected
    robot.events.publish(low)
    await afar.passing(lambda: not context_of(afar.door).app.connected)
    await afar.heal()
    robot.events.publish(low)
    await afar.passing(lambda: afar.app.of(4005))


@pytest.mark.slow
async def test_silence_during_an_update(afar: Afar, robot: Robot) -> None:
    assert await afar.ask(5003, {"modules": [SMALL]}) == {"response": True, "code": 0}
    await afar.fall_silent()
    await afar.heal()
    await afar.passing(lambda: robot[Firmware].progress.share == 1.0)
    assert await afar.ask(5005) == {"download_progress": 100, "upgrade_progress": 0, "code": 0}
    assert (await afar.ask(5004, {"md5": MD5}))["code"] == 0
    await afar.fall_silent()
    await afar.passing(lambda: robot[Firmware].version == "1.3.2.0")  # it continued and has restarted
    await afar.heal()
    await afar.passing(lambda: afar.app.of(5008))
    assert afar.app.of(5008) == [{"success": True, "code": 0}]
