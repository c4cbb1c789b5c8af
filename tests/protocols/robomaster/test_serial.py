"""The pseudo-terminal: what a program on a serial cable sees."""

import asyncio
import contextlib
import os
from pathlib import Path

import pytest

from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from tests.protocols.robomaster.text_client import ADDRESS


async def heard(line: int, lines: int = 1) -> str:
    """Return the output of at least so many lines, or what there is after a while."""
    text = ""
    for _ in range(1000):
        await asyncio.sleep(0.005)
        with contextlib.suppress(BlockingIOError):
            text += os.read(line, 4096).decode()
        if text.count("\n") >= lines:
            break
    return text


@pytest.mark.world("empty", body="robomaster_ep")
async def test_commands_answers_pushes_and_events_on_one_line(robot, world, forward, tmp_path: Path) -> None:
    config = RoboMasterConfig(
        control_port=0, event_port=0, video_port=0, audio_port=0, uart=str(tmp_path / "ep"), profile="fw70"
    )
    door = RoboMasterDoor(robot, ADDRESS, config)
    await door.start()
    line = os.open(tmp_path / "ep-a", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        os.write(line, b"command;")
        assert await heard(line) == "ok;\n"
        os.write(line, b"robot mo")
        await asyncio.sleep(0.01)
        os.write(line, b"de ?;chassis push attitude on afreq 1;armor event hit on;")
        assert await heard(line, 3) == "chassis_lead ;\nok;\nok;\n"
        for _ in range(3):
            os.write(line, b"robot mode ?;")
            assert await heard(line) == "chassis_lead ;\n"
        await forward(seconds=1.001)
        assert (await heard(line)).startswith("chassis push attitude ")
        world.stage.touch_plate("a", PlatePlace.LEFT)
        await forward(seconds=0.1)
        assert "armor event hit 3 2 ;;\n" in await heard(line)
    finally:
        os.close(line)
        await door.close()
    assert not (tmp_path / "ep-a").exists()
