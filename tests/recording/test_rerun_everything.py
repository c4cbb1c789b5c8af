"""Everything in one session, run again: identical to the last byte, also what a dog heard from its app."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from roboglot.recording.reader import read_recording
from tests.recording.everything import hold
from tests.recording.test_rerun import rerun


@pytest.mark.slow  # in short, one protocol each: test_rerun_clients.py
@pytest.mark.timeout(600)  # a hang
@pytest.mark.parametrize("rounds", [1, 30])  # 20 s, and ten minutes
async def test_everything_happens_again(tmp_path: Path, rounds: int) -> None:
    pytest.importorskip("zenoh", reason="needs roboglot[ros2]")
    session = await hold(tmp_path, rounds)
    assert session.pushed
    assert session.photographed > 10_000 * rounds
    recording = read_recording(tmp_path / "r.mcap")
    kinds = {given.kind for _, given in recording.inputs}
    assert kinds - {"called off"} == {"answer", "hands", "command", "came", "gone"}
    heard = {str(given.values["said"]) for _, given in recording.inputs if given.kind == "answer"}
    assert "ok" in heard
    assert heard & {"unavailable", "closed"}, "the app was never lost"
    doors = {exchange.door for exchange in recording.exchanges}
    assert doors == {"slamware", "robomaster", "cyberdog", "visual", "foxglove", "ros2"}
    assert recording.seconds > 20 * rounds
    done = await asyncio.to_thread(rerun, tmp_path / "r.mcap")
    assert done.stdout.startswith("identical: "), done.stdout + done.stderr
