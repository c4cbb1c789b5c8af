"""A lockstep recording run again: identical to the last byte, or the first difference with what came before it."""

from __future__ import annotations

import asyncio
import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from roboglot.cli.recordings.rerun import NoRerun, configuration
from roboglot.clients.slamware import SlamwareClient
from roboglot.config import Config, ConsoleConfig, RecordConfig, RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.protocols import sections
from roboglot.recording.reader import read_recording
from roboglot.runtime import Runtime
from roboglot.wire.slamware.geometry import Location
from roboglot.wire.slamware.motion import MoveOptions, MoveToOptions

WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
ADDRESS = f"127.0.194.{1 + WORKER}"


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


@pytest.mark.parametrize("seconds", [15.0, pytest.param(600.0, marks=pytest.mark.slow)])
async def test_the_same_inputs_give_the_same_bytes(tmp_path: Path, seconds: float) -> None:
    file = await session(tmp_path, seconds)
    done = await asyncio.to_thread(rerun, file)
    assert done.stdout.startswith("identical: "), done.stdout + done.stderr
    assert done.returncode == 0
    assert int(done.stdout.split()[1]) > 30 * seconds


async def test_the_first_difference_is_shown_with_what_came_before(tmp_path: Path) -> None:
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
