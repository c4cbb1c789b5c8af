"""Scripts of ours, unmodified, beside a robot and then beside its recording: they print the same and end the same."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from roboglot.testing.addresses import free_addresses
from tests.docs.docs_terminal import terminal
from tests.recording.scripts import SCRIPTS, Script, play

ADDRESS = free_addresses(1)


async def ended(script: Script, folder: Path, body: str, record: str) -> list[tuple[int, str]]:
    async with terminal(folder, ADDRESS, body, world="empty", record=record) as user:
        return await play(script, user)


def shown(script: Script, ended: list[tuple[int, str]]) -> list[tuple[int, list[str]]]:
    """Return what must be the same: the status of each command and its lines, in any order from two connections."""
    two = script.two_lines or any("program run" in line for line in script.lines)  # blocks, and printed lines
    texts = [(status, re.sub(script.random or "$^", "", said).splitlines()) for status, said in ended]
    return [(status, sorted(lines) if two else lines) for status, lines in texts]


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


def test_lines_of_two_connections_come_in_any_order() -> None:
    saved, printed_first, block_first = (0, "hello is saved"), (0, "hello\none: begins"), (0, "one: begins\nhello")
    two = SCRIPTS["program-list"]
    assert shown(two, [saved, printed_first]) == shown(two, [saved, block_first])
    assert shown(two, [saved, printed_first]) != shown(two, [printed_first, saved])
    one = SCRIPTS["start-rest"]
    assert shown(one, [printed_first]) != shown(one, [block_first])


def test_all_four_protocols_have_their_share_of_scripts() -> None:
    doors = [script.door for script in SCRIPTS.values()]
    assert len(doors) >= 40
    assert all(doors.count(door) >= 7 for door in ("slamware", "robomaster", "cyberdog", "visual"))
    always = {script.door for script in SCRIPTS.values() if not script.slow}
    assert always == set(doors)  # one of each is in every run
