"""The capability page says what the door answers: every command is asked on every simulated body."""

import asyncio
from collections.abc import Iterator

import pytest

from roboglot.cli.capabilities import BODIES, RobotKind
from roboglot.media.audio import AudioStream
from roboglot.media.video import VideoStream
from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.dispatch import answer
from roboglot.protocols.robomaster.table import TABLE
from roboglot.wire.robomaster.replies import PROFILES
from tests.narrowing import of_kind

WORDS = {  # words after the command; those not listed need none
    "robot mode": "free", "chassis speed": "x 0.1", "chassis wheel": "w1 10", "chassis move": "x 0.1",
    "chassis push": "position on attitude on status on", "gimbal speed": "p 1", "gimbal move": "p 1",
    "gimbal moveto": "p 1", "gimbal push": "attitude on", "blaster bead": "1", "armor sensitivity": "5",
    "armor event": "hit on", "sound event": "applause on", "led control": "comp all effect solid", "pwm value": "1 50",
    "pwm freq": "1 50", "sensor_adapter adc ?": "id 1 port 1", "sensor_adapter io_level ?": "id 1 port 1",
    "sensor_adapter pulse_period": "id 1 port 1", "sensor_adapter pulse_period ?": "id 1 port 1",
    "sensor_adapter event": "io_level on", "ir_distance_sensor measure": "on", "ir_distance_sensor distance ?": "1",
    "servo angle": "id 1 angle 1", "servo recenter": "id 1", "servo speed": "id 1 speed 1", "servo angle ?": "id 1",
    "robotic_arm move": "x 0 y 0", "robotic_arm moveto": "x 0 y 0", "AI push": "marker on",
    "AI attribute": "line_color red", "camera exposure": "small",
}  # fmt: skip
SESSION = {"command", "quit"}


class Port:
    """A port for media without sockets."""

    def __init__(self, robot: Robot, stream: type[VideoStream] | type[AudioStream]) -> None:
        self._robot, self._stream = robot, stream

    def switch(self, on: bool) -> None:
        _ = self._robot[self._stream] if on else None


class Outlets:
    """Outlets without listeners."""

    def __init__(self, robot: Robot) -> None:
        self.video, self.audio = Port(robot, VideoStream), Port(robot, AudioStream)

    def push(self, datagram: bytes, host: str) -> None: ...
    def send_event(self, event: bytes) -> None: ...


def commands() -> Iterator[tuple[str, str]]:
    """Each operation's key, and a command that any robot with its parts can do."""
    for operation in TABLE:
        key = str(operation.key)
        name, mark, _ = key.partition(" ?")
        if key not in SESSION:
            yield key, " ".join(filter(None, (name, WORDS.get(key, ""), mark.strip())))


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
async def test_every_command_answers_as_the_page_says(body: str, robot: Robot) -> None:
    kind = RobotKind(body, frozenset(robot.interfaces), {})
    context = Context(robot, PROFILES["spec"], Outlets(robot))  # type: ignore[arg-type]
    wrong = {}
    for key, text in commands():
        await answer(context, "command")
        asked = asyncio.ensure_future(answer(context, text))
        for _ in range(60):
            await of_kind(robot.clock, LockstepClock).advance(0.1)
            if asked.done():
                break
        got = await asked
        refused = got.reply.startswith(b"fail")
        assert b"error" not in got.reply, text
        operation = TABLE.get(key)
        assert operation
        if refused != (kind.judge(operation.needs) == "refused"):
            wrong[text] = (got.reply, got.why)
        context.end("the next one")
        await of_kind(robot.clock, LockstepClock).advance(0.6)
    assert not wrong
