"""Unmodified clients through `roboglot connect` over a line that loses 5 % and takes 50 ms each way.

Where a network device can be made, the kernel's own TCP bears the losses; elsewhere a relay behaves as TCP would.
"""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import httpx
import pytest

from roboglot.access.store import Grant, open_store
from roboglot.access.tunnel.connector import Connector, KnownGateways
from roboglot.clients.cyberdog import Certificates, CyberDogClient, CyberDogRefused
from roboglot.clients.visual import TextLink
from roboglot.config import AccessConfig, RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.operations import Right
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.access.lossy_device import LossyDevice
from tests.access.lossy_proxy import lossy_proxy
from tests.access.matrix import ADDRESS, frame_states
from tests.protocols.robomaster.clients.test_robomasterpy import TOUR, check, listen

HERE = free_addresses(1)
PACE = 2.0  # s of the robot in a second: no more, as its patience with a slow line is in its own seconds


@contextlib.asynccontextmanager
async def behind_a_bad_line(folder: Path, body: str, world: str) -> AsyncIterator[Runtime]:
    """Yield a robot at HERE, whose time passes twice as fast as outside."""
    store = open_store(folder)
    token = store.add_machine("cell", [Grant("a", frozenset({Right.PROGRAM, Right.EDIT}))])
    store.close()
    base = load_config(None, {"data": str(folder), "world": world, "lockstep": True})
    line = made_device()
    access = AccessConfig(on=True, local=False, gateway=f"{line.near if line else '127.0.0.1'}:0")
    runtime = Runtime(replace(base, robots=(RobotConfig("a", body, ADDRESS),), access=access))
    await runtime.start()
    assert runtime._gateway is not None
    assert isinstance(runtime.clock, LockstepClock)
    opened = asyncio.Event()
    async with led_to(runtime._gateway.port, line) as (host, port):
        known = KnownGateways(folder / "gateways.json")
        connector = Connector(host, port, "a", token, HERE, known)
        running = asyncio.ensure_future(connector.run(lambda *_: opened.set()))
        passing = asyncio.ensure_future(pass_time(runtime.clock))
        await asyncio.wait([asyncio.ensure_future(opened.wait()), running], return_when=asyncio.FIRST_COMPLETED)
        try:
            yield runtime
            assert not running.done(), "the tunnel bears all that"
        finally:
            for task in (running, passing):
                task.cancel()
            await asyncio.gather(running, passing, return_exceptions=True)
            await runtime.close()


def made_device() -> LossyDevice | None:
    """Return a lossy device; None if this process may not make one."""
    try:
        return LossyDevice()
    except OSError:
        return None


@contextlib.asynccontextmanager
async def led_to(port: int, device: LossyDevice | None) -> AsyncIterator[tuple[str, int]]:
    """Yield the address at which the bad line lies between here and ``port``."""
    if device is None:
        async with lossy_proxy(port) as relayed:
            yield "127.0.0.1", relayed
    else:
        with device:
            yield device.far, port
        assert device.lost > 0


async def pass_time(clock: LockstepClock) -> None:
    """Pass time at PACE, or slower on a busy machine: the app is lost after so many seconds of the robot."""
    loop = asyncio.get_running_loop()
    before = loop.time()
    while True:
        await asyncio.sleep(0.005)
        before, passed = loop.time(), loop.time() - before
        await clock.advance(PACE * min(passed, 0.025))


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.access.tunnel.heartbeat.QUIET_AFTER", 20.0)  # a busy machine is no silent line


@pytest.mark.slow  # real time behind a bad line; test_tunnel.py has the tunnel itself
async def test_robomasterpy_sees_what_it_sees_without(tmp_path: Path, vendor_ports: None) -> None:
    async with behind_a_bad_line(tmp_path, "robomaster_ep", "office") as runtime:
        stage = runtime.fleet.world.stage
        pipe = asyncio.subprocess.PIPE
        tour = await asyncio.create_subprocess_exec(sys.executable, str(TOUR), HERE, stdout=pipe, stderr=pipe)
        said: list[str] = []
        async with asyncio.timeout(90.0):
            errors = await listen(tour, said, lambda: stage.touch_plate("a", PlatePlace.REAR))
        assert tour.returncode == 0, errors.decode()
        check(said, HERE, late=True)


@pytest.mark.slow  # real time behind a bad line; test_tunnel.py has the tunnel itself
async def test_rest_a_phone_and_programs_work(tmp_path: Path) -> None:
    async with behind_a_bad_line(tmp_path, "universal", "empty") as runtime:
        async with asyncio.timeout(60.0):
            await asyncio.gather(drive_by_rest(), run_a_program())
            await use_a_phone(tmp_path)
        assert runtime.fleet.world.truth.pose_of("a").x > 0.05


async def drive_by_rest() -> None:
    async with httpx.AsyncClient(base_url=f"http://{HERE}:1448", timeout=60, verify=False) as client:
        pages = await asyncio.gather(*(client.get("/openapi.json") for _ in range(3)))
        assert len({page.content for page in pages}) == 1
        assert (await client.get("/api/core/slam/v1/localization/pose")).status_code == 200
        assert (await client.post("/api/core/system/v1/power/:shutdown", json={})).status_code == 403


async def run_a_program() -> None:
    link = await TextLink.open(f"ws://{HERE}:50053", "/programs")
    body = "cyberdog.motion.resume_standing()\ncyberdog.motion.go_straight(x_velocity=0.3, distance=0.3)\n"
    frames: list[dict[str, object]] = [
        {
            "type": "task",
            "operate": "debug",
            "target_id": ["debug"],
            "mode": "single",
            "condition": "now",
            "describe": "",
            "style": "",
            "body": body,
        }
    ]
    [(state, words)] = await frame_states(link, frames)
    assert not state, words
    async for text in link:
        if '"operate": "stop"' in text or '"shutdown"' in text:
            break
    await link.close()


async def use_a_phone(folder: Path) -> None:
    out = folder / "phone"
    export_client(folder / "cyberdog", out)
    async with CyberDogClient(HERE, Certificates.load(out)) as dog:
        first = await dog.found()
        assert first.battery > 0
        async with asyncio.timeout(60.0):
            while dog.heartbeat is None or dog.heartbeat.at == first.at:  # noqa: ASYNC110 - they come twice a second
                await asyncio.sleep(0.05)
        await dog.stand()
        photo = await dog.photo()
        assert photo.data.startswith(b"\xff\xd8")
        with pytest.raises(CyberDogRefused, match="carries no WebRTC"):
            await dog.negotiate("phone", "v=0")
