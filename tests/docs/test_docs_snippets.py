"""The pages' Python runs as it is printed there, beside a robot in lockstep, with the names that the text gives."""

from __future__ import annotations

import ast
import asyncio
import re
from pathlib import Path
from typing import Any

import pytest

from roboglot.media.audio import AudioStream
from roboglot.media.recorder import Recorder
from roboglot.media.video import VideoStream
from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.reflectors import Reflectors
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Emotion, Gesture, Sport
from roboglot.model.robot import Robot
from roboglot.model.sound import claps
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Call, Failed, Finished, Output
from roboglot.programs.worker.prelude import Prelude
from roboglot.simulation.components.motion.emergency_stop import SimulatedEmergencyStop
from roboglot.simulation.world.world import World
from tests.docs.test_docs import ROOT, blocks
from tests.narrowing import of_kind

LOOK = re.compile(r"(async for frame in frames|async for packet in packets): \.\.\.")
SECONDS = 3.0  # s of robot time, for snippets that watch without end


def snippet(page: str, words: str) -> str:
    [found] = [code for code in blocks(ROOT / "docs" / page, "python") if words in code]
    return LOOK.sub(r"\1: break", found)


async def run(code: str, clock: LockstepClock, **names: Any) -> None:
    """Run it until it ends, or has watched for a while."""
    work = eval(compile(code, "page", "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT), names)
    running = asyncio.ensure_future(work) if work is not None else None
    end = clock.time() + SECONDS
    while clock.time() < end and not (running and running.done()):
        await clock.advance(0.02)
        await asyncio.sleep(0)
    if running:
        running.cancel()
        await asyncio.wait([running])
        if not running.cancelled():
            running.result()


@pytest.mark.world("playground")
async def test_cameras_and_sounds(
    robot: Robot, world: World, clock: LockstepClock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names: dict[str, object] = {
        kind.__name__: kind for kind in (Camera, VideoStream, Recorder, AudioStream, Speaker, Point)
    }
    monkeypatch.chdir(tmp_path)
    names |= {"claps": claps, "Path": Path}
    await run(snippet("worlds/camera.md", "capture()"), clock, robot=robot, world=world, **names)
    assert (tmp_path / "tour.mp4").exists()


@pytest.mark.world("playground")
async def test_perception_snippet_runs(robot: Robot, clock: LockstepClock) -> None:
    kinds = {kind.__name__: kind for kind in (Vision, Hearing, Reflectors)}
    await run(snippet("worlds/perception.md", "Vision].markers"), clock, robot=robot, **kinds)


@pytest.mark.world("playground")
async def test_people_do_as_asked(robot: Robot, world: World, clock: LockstepClock) -> None:
    names: dict[str, object] = {kind.__name__: kind for kind in (Gesture, Sport, Emotion)}
    await run(snippet("worlds/perception.md", "stage.person"), clock, world=world, **names)


@pytest.mark.world("office", body="hermes")
async def test_stage_on_a_delivery_robot(robot: Robot, world: World, clock: LockstepClock) -> None:
    code = snippet("worlds/worlds.md", "cargo.put").replace('robot("b")', 'robot("a")')
    await run(code, clock, world=world, Cargo=Cargo, EmergencyStop=EmergencyStop, Pose=Pose)
    assert of_kind(robot[EmergencyStop], SimulatedEmergencyStop).pressed


async def test_an_engine_by_hand() -> None:
    names: dict[str, object] = {kind.__name__: kind for kind in (Prelude, Engine, Output, Call, Finished, Failed)}
    printed: list[Any] = []
    code = compile(snippet("programs/programs.md", "Engine()"), "page", "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
    await eval(code, {"print": lambda *words, **_: printed.extend(words), **names})
    assert printed[0] == "turned\n"
    assert isinstance(printed[-1], Finished)
