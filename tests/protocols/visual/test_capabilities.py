"""The capability page says what programs get: each function is called on each simulated body, and on a bare robot."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import pytest

from roboglot.cli.capabilities import BODIES, RobotKind
from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.functions.results import StateCode
from roboglot.programs.functions.table import state_of
from roboglot.programs.worker.values import Record
from roboglot.protocols.visual import DOOR
from tests.programs.functions.calling import Caller

LINE_ON, HEAD = 9, 1
WORDS: dict[str, tuple[object, ...]] = {  # arguments that some functions need to get as far as the part
    "cyberdog.audio.play": ("hello",),
    "cyberdog.audio.instantly_play": ("hello",),
    "cyberdog.led.play": (HEAD, 0xA1),
    "cyberdog.led.play_rgb": (HEAD, LINE_ON, 1, 2, 3),
    "cyberdog.led.freed": (HEAD,),
    "choreographer.moonwalk": (0.05, 0, 0.05, 1),
    "choreographer.push_up": (30, 2),
    "cyberdog.skeleton.turn_on_recognition": (1, 1),
    "cyberdog.skeleton.sports_recognition": (1, 1),
    "cyberdog.personnel.face_recognized": ([],),
    "cyberdog.personnel.voiceprint_recognized": ([],),
    "cyberdog.motion.run_sequence": (Record("MotionSequence", {"gait_list": [], "pace_list": []}),),
}
REPORTS = ".state"  # its result reports a missing part, as it should
PATIENCE = 10  # times 0.1 s for a call


@dataclass
class Answer:
    """Answer to a call."""

    words: str
    failed: bool

    @property
    def names_a_missing_part(self) -> bool:
        """True if it says that the robot lacks a part."""
        return "this robot has no" in self.words


async def ask(caller: Caller, name: str) -> Answer:
    """Call a function; one that goes on for longer than ``PATIENCE`` works."""
    task = caller.start(name, *WORDS.get(name, ()))
    await caller.clock.advance(0.0)
    for _ in range(PATIENCE):
        if task.done():
            break
        await caller.clock.advance(0.1)
    else:
        task.cancel()
    try:
        result = await task
    except asyncio.CancelledError:
        return Answer("", failed=False)
    except Exception as error:  # noqa: BLE001 - a program gets it, whatever it is
        return Answer(str(error), failed=True)
    found = state_of(result)
    return Answer(str(result), failed=found is not None and found.fields["code"] != StateCode.SUCCESS)


@pytest.mark.parametrize(
    "body",
    [
        pytest.param(
            b,
            marks=[
                pytest.mark.world("office", body=b),
                *([] if b in ("hermes", "robomaster_ep") else [pytest.mark.slow]),
            ],
        )
        for b in BODIES
    ],
)
async def test_functions_are_refused_as_the_page_says(body: str, robot: Robot, clock: LockstepClock) -> None:
    kind = RobotKind(body, frozenset(robot.interfaces), {})
    caller, wrong = Caller(robot, clock), {}
    for operation in DOOR.table():
        name = str(operation.key)
        if not name.endswith(REPORTS):
            answer = await ask(caller, name)
            refused = kind.judge(operation.needs) == "refused"
            # A call without its part may have another fault before it asks for the part.
            if answer.failed < refused or (answer.names_a_missing_part and not refused):
                wrong[name] = answer.words
    assert wrong == {}


async def test_a_bare_robot_refuses_what_needs_a_part(clock: LockstepClock) -> None:
    plate = dict.fromkeys(("maker", "model", "serial", "hardware_version", "software_version"), "")
    caller = Caller(Robot("a", Description(**plate, radius=0.2, height=0.3), clock), clock)
    wrong = {}
    for operation in DOOR.table():
        name = str(operation.key)
        if not name.endswith(REPORTS):
            answer = await ask(caller, name)
            if answer.failed < bool(operation.needs) or (answer.names_a_missing_part and not operation.needs):
                wrong[name] = answer.words
    assert wrong == {}
