"""Scripts of ours, unmodified, beside a robot and then beside its recording: they print the same and end the same."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest

from tests.docs.docs_terminal import terminal
from tests.recording.scripts import SCRIPTS, Script, play

WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])  # workers run in parallel
ADDRESS = f"127.0.196.{1 + WORKER}"


async def ended(script: Script, folder: Path, body: str, record: str) -> list[tuple[int, str]]:
    async with terminal(folder, ADDRESS, body, world="empty", record=record) as user:
        return await play(script, user)


def shown(script: Script, ended: list[tuple[int, str]]) -> list[str]:
    """Return the lines that must be the same."""
    texts = [f"{status} {re.sub(script.random or '$^', '', said)}" for status, said in ended]
    lines = "\n".join(texts).splitlines()
    two = script.two_lines or any("program run" in line for line in script.lines)  # blocks, and printed lines
    return sorted(lines) if two else lines


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if script.slow else []) for name, script in SCRIPTS.items()]
)
async def test_a_script_ends_the_same_beside_the_recording(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    script, file = SCRIPTS[name], tmp_path / "r.mcap"
    if shutil.which(script.needs) is None:
        pytest.skip(f"needs {script.needs}")
    if script.door == "robomaster" and script.code:
        request.getfixturevalue("vendor_ports")
    for folder in ("then", "now"):
        (tmp_path / folder).mkdir()
    then = await ended(script, tmp_path / "then", script.body, str(file))
    now = await ended(script, tmp_path / "now", f"recording:{file}", "")
    assert any(said for _, said in then)
    assert shown(script, now) == shown(script, then)


def test_all_four_protocols_have_their_share_of_scripts() -> None:
    doors = [script.door for script in SCRIPTS.values()]
    assert len(doors) >= 40
    assert all(doors.count(door) >= 7 for door in ("slamware", "robomaster", "cyberdog", "visual"))
    always = {script.door for script in SCRIPTS.values() if not script.slow}
    assert always == set(doors)  # one of each is in every run
