"""A lockstep recording run again: identical to the last byte, or the first difference with what came before it."""

from __future__ import annotations

import asyncio
import dataclasses
import itertools
import json
import subprocess
import sys
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect

from roboglot.cli.recordings.rerun import NoRerun, configuration
from roboglot.clients.slamware import SlamwareClient
from roboglot.config import Config, ConsoleConfig, RecordConfig, RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols import sections
from roboglot.recording.inputs import is_of_client
from roboglot.recording.reader import read_recording
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from roboglot.wire.slamware.chapters.motion import MoveOptions, MoveToOptions
from roboglot.wire.slamware.geometry import Location

ADDRESS = free_addresses(1)


def config(folder: Path, **more: object) -> Config:
    base = load_config(None, {"data": str(folder / "data"), "world": "office", "lockstep": True, **more}, sections())
    return dataclasses.replace(
        base,
        robots=(RobotConfig("a", "universal", ADDRESS),),
        record=RecordConfig(to=str(folder / "r.mcap")),
        console=ConsoleConfig(enabled=False),
    )


async def session(folder: Path, seconds: float, **more: object) -> Path:
    """Drives by two protocols at odd times."""
    runtime = Runtime(config(folder, **more))
    await runtime.start()
    clock = runtime.clock
    assert isinstance(clock, LockstepClock)
    rest = SlamwareClient(ADDRESS)
    reader, writer = await asyncio.open_connection(ADDRESS, 40923)
    try:
        await clock.advance(1.037)
        await rest.get_power_status()
        await rest.begin("MoveToAction", MoveToOptions(Location(0.8, 0.2), MoveOptions()))
        for number in range(int(seconds / 5)):
            await clock.advance(2.513)
            await rest.get_pose()
            for text in (b"command;", b"chassis position ?;", b"robot battery ?;"):
                writer.write(text)
                await reader.readuntil(b";")
            await clock.advance(1.511)
            if number % 3 == 1:
                target = Location(0.5 * (number % 4), 0.2)
                await rest.begin("MoveToAction", MoveToOptions(target, MoveOptions()))
            await clock.advance(0.976)
        await clock.advance(0.5)
    finally:
        rest.close()
        writer.close()
        await runtime.close()
    return folder / "r.mcap"


def rerun(file: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "roboglot", "rerun", str(file), *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.slow  # text clients, dogs and programs are run again in test_rerun_clients.py
@pytest.mark.parametrize("seconds", [15.0, 600.0])
async def test_the_same_inputs_give_the_same_bytes(tmp_path: Path, seconds: float) -> None:
    file = await session(tmp_path, seconds)
    done = await asyncio.to_thread(rerun, file)
    assert done.stdout.startswith("identical: "), done.stdout + done.stderr
    assert done.returncode == 0
    assert int(done.stdout.split()[1]) > 30 * seconds


PROGRAM = """
import random
cyberdog.task.block('one')
print(random.random())
cyberdog.motion.turn(90)
for number in range(4):
    cyberdog.task.block('b%d' % random.randint(0, 99))
    time.sleep(0.3)
"""


async def with_programs(folder: Path, turns: int) -> Path:
    """Record a front end that saves, runs, suspends and lists programs, and does not wait for answers."""
    runtime = Runtime(config(folder))
    await runtime.start()
    clock = runtime.clock
    assert isinstance(clock, LockstepClock)
    rest = SlamwareClient(ADDRESS)
    heard = 0

    def hear(exchange: Exchange) -> None:
        nonlocal heard
        heard += exchange.door == "visual" and exchange.direction is Direction.REQUEST

    runtime.fleet.robots["a"].tap.listen(hear)
    numbers = itertools.count()
    async with connect(f"ws://{ADDRESS}:50053/programs") as socket, asyncio.TaskGroup() as tasks:

        async def send(operate: str, body: str = "") -> None:
            number = next(numbers)
            targets = [] if operate == "inquiry" else ["t"]
            frame = {"type": "task", "target_id": targets, "mode": "single", "condition": "now", "style": ""}
            await socket.send(
                json.dumps({**frame, "describe": "", "id": f"x-{number}", "operate": operate, "body": body})
            )
            while heard <= number:  # noqa: ASYNC110
                await asyncio.sleep(0)

        reading = tasks.create_task(read_all(socket))
        await clock.advance(1.0)
        await send("save", PROGRAM)
        for turn in range(turns):
            await clock.advance(1.037)
            await send("run")
            for number in range(5):
                await clock.advance(0.713)
                await rest.get_pose()
                if turn % 2 and number in (1, 3):
                    await send("suspend" if number == 1 else "recover")
                await send("inquiry")
            await clock.advance(2.0)
        reading.cancel()
    rest.close()
    await runtime.close()
    return folder / "r.mcap"


async def read_all(socket: ClientConnection) -> None:
    async for _ in socket:
        pass


@pytest.mark.slow  # a program is run again in test_rerun_clients.py
@pytest.mark.parametrize("turns", [2, 90])  # 13 s and ten minutes
async def test_programs_do_the_same_again(tmp_path: Path, turns: int) -> None:
    file = await with_programs(tmp_path, turns)
    ends = [e.payload for e in read_recording(file).of(door="visual") if b'"stop"' in e.payload]
    assert len(ends) == turns
    done = await asyncio.to_thread(rerun, file)
    assert done.stdout.startswith("identical: "), done.stdout + done.stderr


def test_only_what_clients_sent_is_sent_again() -> None:
    rest = ("", Direction.REQUEST, "", b"{}")
    places = [("visual", "127.0.0.1:5"), ("visual", "ipv4:127.0.0.1:5"), ("driver/slamware", "1.2.3.4:1448")]
    places.append(("cyberdog", "ipv4:127.0.0.1:5"))
    said = [Exchange(1.0, "a", door, connection, *rest) for door, connection in places]
    assert [(e.door, e.connection) for e in said if is_of_client(e)] == [places[0], places[3]]


async def test_nothing_is_recorded_after_the_end_begins(tmp_path: Path) -> None:
    """A robot comes to a stand while the runtime closes, in robot time that depends on the machine."""
    runtime = Runtime(config(tmp_path))
    await runtime.start()
    assert isinstance(runtime.clock, LockstepClock)
    rest = SlamwareClient(ADDRESS)
    await rest.begin("MoveToAction", MoveToOptions(Location(3.0, 0.2), MoveOptions()))
    await runtime.clock.advance(2.08)
    end = runtime.clock.time()
    rest.close()
    await runtime.close()
    recording = read_recording(tmp_path / "r.mcap")
    assert runtime.clock.time() > end
    assert (recording.last - recording.first) / 1e9 <= end


async def test_first_difference_is_shown_with_what_came_before(tmp_path: Path) -> None:
    file = await session(tmp_path, 5.0)
    recording = read_recording(file)
    values = json.loads(recording.attachments["config.json"]) | {"seed": 2}
    assert file.read_bytes()
    changed = tmp_path / "changed"
    changed.mkdir()
    await session(changed, 5.0, seed=2)
    (other,) = changed.glob("*.mcap")
    from roboglot.recording.traces import difference

    verdict = difference(file, other)
    assert values["seed"] == 2
    assert verdict.difference is not None
    assert verdict.difference.recorded != verdict.difference.now
    assert difference(file, file).difference is None


async def test_a_recording_of_a_running_clock_is_refused(tmp_path: Path) -> None:
    file = await session(tmp_path, 1.0)
    recording = read_recording(file)
    recording.facts["clock"] = "x1"
    with pytest.raises(NoRerun, match="running clock"):
        configuration(recording, tmp_path)
