"""A recorded robot answers a live client as it answered then: the same unmodified clients end with the same result."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import json
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from roboglot.clients.errors import LinkLost
from roboglot.config import Config, ConsoleConfig, RecordConfig, RobotConfig, load_config
from roboglot.demo.clients.phone import Phone
from roboglot.demo.clients.robomaster import RoboMasterClient
from roboglot.demo.clients.slamware import SlamwareClient
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.tap import Direction
from roboglot.protocols import sections
from roboglot.protocols.cyberdog.certificates import ensure_certificates, export_client
from roboglot.recording.lines import Target
from roboglot.recording.playback import open_playback
from roboglot.recording.proxy.relay import ExchangeWriter
from roboglot.recording.reader import read_recording
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

ADDRESS, SECOND = free_addresses(1), free_addresses(1)
SPEED = 4.0
FAST, LATE = 40.0, 0.2  # s of the robot
PROGRAM = "cyberdog.task.block('one');\ncyberdog.task.block('two');\n"
Script = Callable[[str], Awaitable[Any]]


def config(folder: Path, body: str, record: str, **doors: dict[str, object]) -> Config:
    base = load_config(None, {"data": str(folder / "data"), "world": "empty", "speed": SPEED, **doors}, sections())
    robots = (RobotConfig("a", body, ADDRESS),)
    return dataclasses.replace(
        base, robots=robots, record=RecordConfig(to=record), console=ConsoleConfig(enabled=False)
    )


async def run(folder: Path, body: str, record: str, script: Script, **doors: dict[str, object]) -> Any:
    started = Runtime(config(folder, body, record, **doors))
    await started.start()
    try:
        return await script(ADDRESS)
    finally:
        await started.close()


async def twice(folder: Path, script: Script, **doors: dict[str, object]) -> tuple[Any, Any]:
    """Return the script's result with a simulated robot, and with its recording."""
    file = folder / "r.mcap"
    first = await run(folder, "universal", str(file), script, **doors)
    return first, await run(folder, f"recording:{file}", "", script, **doors)


async def by_rest(address: str) -> Any:
    client = SlamwareClient(address)
    try:
        await client.wait_for_map()
        before = await client.pose()
        await client.move_to(before[0] + 0.6, before[1], before[2])
        return await client.pose()
    finally:
        await client.close()


async def by_text(address: str) -> Any:
    client = await asyncio.to_thread(RoboMasterClient, address)
    try:
        await client.ahead(0.5)
        return await client.position()
    finally:
        await client.close()


async def by_frames(address: str) -> Any:
    task = {"type": "task", "target_id": ["t"], "mode": "single", "condition": "now", "style": "", "describe": ""}
    seen: list[Any] = []
    async with connect(f"ws://{address}:50053/programs") as socket, asyncio.timeout(60):
        for number, (operate, body) in enumerate((("save", PROGRAM), ("run", ""), ("inquiry", ""))):
            targets = [] if operate == "inquiry" else ["t"]
            frame = {**task, "target_id": targets, "id": f"{address}-{number}", "operate": operate, "body": body}
            await socket.send(json.dumps(frame))
            while operate == "run":
                found = json.loads(await socket.recv())
                seen.append((found["feedback"]["operate"], found["feedback"]["state"], found.get("block")))
                if found["feedback"]["operate"] == "stop":
                    break
        while "response" not in (found := json.loads(await socket.recv())):
            seen.append(found["feedback"]["operate"])
        return seen, found["response"]["id"]


async def test_the_rest_client_ends_with_the_same_result(tmp_path: Path) -> None:
    first, second = await twice(tmp_path, by_rest)
    assert first == second
    assert first[0] > 0.4


async def test_the_text_client_ends_with_the_same_result(tmp_path: Path, vendor_ports: None) -> None:
    first, second = await twice(tmp_path, by_text)
    assert first == second
    assert first[0] > 0.4


async def test_front_end_of_programs_ends_with_same_result(tmp_path: Path) -> None:
    first, second = await twice(tmp_path, by_frames)
    assert first == second
    assert [block["id"] for *_, block in first[0][:-1] if block and block["type"] == "begin"] == ["one", "two"]


@pytest.mark.slow  # in short: test_front_end_of_programs_ends_with_same_result
async def test_front_end_repeats_its_result_on_busy_machines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Playback is late by 0.2 s of the robot at every step; ten times as fast as otherwise, so that it costs little."""

    async def hog() -> None:
        while True:
            time.sleep(LATE / FAST)  # noqa: ASYNC251 - that nothing else runs is what is tested
            await asyncio.sleep(0)

    first = await run(tmp_path, "universal", str(tmp_path / "r.mcap"), by_frames)
    monkeypatch.setattr("tests.recording.test_playback.SPEED", FAST)
    hogging = asyncio.create_task(hog())
    try:
        assert await run(tmp_path, f"recording:{tmp_path / 'r.mcap'}", "", by_frames) == first
    finally:
        hogging.cancel()


@pytest.mark.slow  # in short: test_calls_end_with_the_status_of_the_recording
async def test_app_of_dog_ends_with_the_same_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.recording.test_playback.SPEED", 1.5)  # it drives, on a busy machine, too
    ensure_certificates(tmp_path / "data" / "cyberdog")
    export_client(tmp_path / "data" / "cyberdog", tmp_path / "certificates")
    phone = Phone(ADDRESS, tmp_path / "certificates")
    await phone.open()

    async def by_phone(address: str) -> Any:
        rest = SlamwareClient(address)
        await rest.wait_for_map()
        await rest.close()
        await phone.relocalise()
        await phone.navigate(0.5, 0.0, 0.0)
        x, y, _yaw = await phone.pose()
        return round(x, 1), round(y, 1), await phone.run(PROGRAM)

    try:
        first, second = await twice(tmp_path, by_phone, cyberdog={"app": f"127.0.0.1:{phone.port}"})
    finally:
        await phone.close()
    assert first == second
    assert first[2] == ["one", "two"]


async def test_unrecorded_requests_get_each_protocols_own_error(tmp_path: Path) -> None:
    file = tmp_path / "r.mcap"
    await run(tmp_path, "universal", str(file), by_rest)

    async def ask_others(address: str) -> Any:
        client = SlamwareClient(address)
        answer = await client._http.get("/api/core/system/v1/robot/health")
        missing = "the recording has no such request: GET /api/core/system/v1/robot/health"
        assert answer.text == f"Not Implemented: {missing}"  # named once
        await client.close()
        reader, writer = await asyncio.open_connection(address, 40923)
        writer.write(b"command;")
        text = await reader.readuntil(b";")
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
        return answer.status_code, text

    assert await run(tmp_path, f"recording:{file}", "", ask_others) == (501, b"fail;")


async def test_a_file_with_several_robots_needs_a_name(tmp_path: Path) -> None:
    base = config(tmp_path, "universal", str(tmp_path / "r.mcap"))
    started = Runtime(dataclasses.replace(base, robots=(*base.robots, RobotConfig("b", "universal", SECOND))))
    await started.start()
    for address in (ADDRESS, SECOND):
        await by_pose(address)
    await started.close()
    assert read_recording(tmp_path / "r.mcap").robots == ["a", "b"]
    clock = LockstepClock()
    with pytest.raises(ValueError, match="#NAME"):
        open_playback(str(tmp_path / "r.mcap"), clock)
    open_playback(f"{tmp_path / 'r.mcap'}#b", clock)
    with pytest.raises(ValueError, match="no robot 'c'"):
        open_playback(f"{tmp_path / 'r.mcap'}#c", clock)


async def by_pose(address: str) -> None:
    client = SlamwareClient(address)
    await client.pose()
    await client.close()


async def test_calls_end_with_the_status_of_the_recording(tmp_path: Path) -> None:
    """A proxy's recording of a dog that was too busy for one call."""
    export_client(tmp_path / "data" / "cyberdog", tmp_path / "certificates")
    path = tmp_path / "dog.mcap"
    writer = ExchangeWriter(path, Target(f"cyberdog://{ADDRESS}"), "0")
    for status, payload in (("ok", b'{"gears": 1}'), ("error RESOURCE_EXHAUSTED", b"")):
        asked = writer.note("127.0.0.1:1", Direction.REQUEST, "8013", status.encode(), "", None)
        writer.note("127.0.0.1:1", Direction.REPLY, "8013", payload, status, asked)
    writer.close()

    async def ask(host: str) -> list[str]:
        line = Target(f"cyberdog://{host}?certs={tmp_path / 'certificates'}").line(RealClock(), lambda *_: None)
        await line.open()
        try:
            said = [status for _, status in await line.request("8013", b"ok", [b""])]
            with pytest.raises(LinkLost) as ended:
                await line.request("8013", b"error RESOURCE_EXHAUSTED", [b""])
        finally:
            await line.close()
        return [*said, ended.value.status]

    assert await run(tmp_path, f"recording:{path}", "", ask) == ["ok", "error RESOURCE_EXHAUSTED"]
