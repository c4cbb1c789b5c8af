"""Sequences of commands against a small model of the robot's modes, and random bytes against the door's dispatch."""

import asyncio
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.media.audio import AudioStream
from roboglot.media.video import VideoStream
from roboglot.model.clock import LockstepClock
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.dispatch import answer
from roboglot.protocols.robomaster.ports.media_port import MediaPort
from roboglot.protocols.robomaster.table import TABLE
from roboglot.storage.database import Database
from roboglot.wire.robomaster.lines import LineSplitter
from roboglot.wire.robomaster.replies import PROFILES

PARSE_ERROR = "command format error: command parse error"
GROUP = {"person", "gesture", "marker", "robot"}
KNOWN = {"ok;", "fail;", f"{PARSE_ERROR};", "not in sdk mode;", "Already in SDK mode;", "quit sdk mode failed;"}

Lab = SimpleNamespace


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    with asyncio.Runner() as runner:
        clock, database = LockstepClock(), Database(":memory:")

        async def build() -> Fleet:
            fleet = build_fleet("empty", [RobotConfig(body="robomaster_ep")], clock=clock, seed=1, database=database)
            await fleet.start(wait=True)
            return fleet

        fleet = runner.run(build())
        yield Lab(runner=runner, clock=clock, robot=fleet.robots["a"])
        runner.run(fleet.close())
        database.close()


def session_of(lab: Lab, profile: str) -> Context:
    outlets = SimpleNamespace(
        video=MediaPort(lab.robot, VideoStream),
        audio=MediaPort(lab.robot, AudioStream),
        push=lambda _datagram, _host: None,
        send_event=lambda _event: None,
    )
    return Context(lab.robot, PROFILES[profile], outlets)


async def finish(lab: Lab, context: Context) -> None:
    """End it and let the robot come to rest."""
    context.end("over")
    for _ in range(50):
        if not lab.robot.actions.running():
            return
        await lab.clock.advance(0.1)


class Model:
    """Model of the manual's answers to each command, as far as modes go."""

    def __init__(self) -> None:
        self.active = False
        self.fresh()

    def fresh(self) -> None:
        self.mode, self.beads, self.sensitivity, self.seeing = "chassis_lead", 1, 5, set()
        self.asleep = False

    def answer(self, text: str) -> str:
        words = text.split()
        if words == ["command"]:
            was, self.active = self.active, True
            return "Already in SDK mode" if was else "ok"
        if words == ["quit"]:
            was, self.active = self.active, False
            self.fresh()
            return "ok" if was else "quit sdk mode failed"
        return self._inside(words) if self.active else "not in sdk mode"

    def _inside(self, words: list[str]) -> str:  # noqa: C901 - a table of commands
        match words:
            case ["robot", "mode", "?"]:
                return self.mode
            case ["robot", "mode", mode]:
                self.mode = mode
            case ["blaster", "bead", "?"]:
                return str(self.beads)
            case ["blaster", "bead", number]:
                if not 1 <= int(number) <= 5:
                    return "fail"
                self.beads = int(number)
            case ["armor", "sensitivity", "?"]:
                return str(self.sensitivity)
            case ["armor", "sensitivity", number]:
                if not 1 <= int(number) <= 10:
                    return "fail"
                self.sensitivity = int(number)
            case ["gimbal", "suspend" | "resume" as word]:
                self.asleep = word == "suspend"
            case ["gimbal", "speed", *_]:
                return "fail" if self.asleep else "ok"
            case ["AI", "push", *pairs]:
                return self._see(dict(zip(pairs[::2], pairs[1::2], strict=True)))
        return "ok"

    def _see(self, wanted: dict[str, str]) -> str:
        after = {name for name in {*self.seeing, *wanted} if wanted.get(name, "on") == "on"}
        if len(after & GROUP) > 1:
            return "fail"
        self.seeing = after
        return "ok"


commands = st.one_of(
    st.sampled_from(["command", "command", "quit", "robot mode ?", "blaster bead ?", "armor sensitivity ?"]),
    st.sampled_from(["robot mode free", "robot mode gimbal_lead", "robot mode chassis_lead"]),
    st.sampled_from(["gimbal suspend", "gimbal resume", "gimbal speed p 5", "stream on", "audio off", "game_msg on"]),
    st.integers(-1, 12).map(lambda number: f"blaster bead {number}"),
    st.integers(-1, 12).map(lambda number: f"armor sensitivity {number}"),
    st.dictionaries(
        st.sampled_from(["person", "gesture", "marker", "robot", "line"]), st.sampled_from(["on", "off"]), min_size=1
    ).map(lambda pairs: " ".join(["AI push", *(f"{name} {word}" for name, word in pairs.items())])),
)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(commands, min_size=1, max_size=25))
def test_every_sequence_answers_as_the_modes_say(lab: Lab, texts: list[str]) -> None:
    async def run() -> None:
        context, model = session_of(lab, "spec"), Model()
        for text in ["command", *texts]:
            said = asyncio.ensure_future(answer(context, text))
            while not said.done():
                await lab.clock.advance(0.05)
            assert said.result().reply.decode() == f"{model.answer(text)};", text
        await finish(lab, context)

    lab.runner.run(run())


WORDS = ("x", "y", "z", "p", "on", "off", "freq", "id", "port", "comp", "effect", "attitude", "hit", "level", "seq",
         "?", "nan", "1e999", "-1", "0x3f", "true")  # fmt: skip
heads = st.sampled_from(sorted(operation.key for operation in TABLE if operation.key not in ("quit", "chassis move")))
words = st.one_of(
    st.sampled_from(WORDS),
    st.integers(-2000, 2000).map(str),
    st.floats(width=16).map(str),
    st.text(max_size=8),
)


@pytest.mark.parametrize("profile", ["spec", *(pytest.param(fw, marks=pytest.mark.slow) for fw in ("fw60", "fw70"))])
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(head=heads, tail=st.lists(words, max_size=8))
def test_every_command_is_answered_once(lab: Lab, profile: str, head: str, tail: list[str]) -> None:
    async def run() -> None:
        context = session_of(lab, profile)
        context.begin()
        text = " ".join([head, *tail, "wait_for_complete false"]).replace(";", "")
        if head.endswith("?"):
            text += " ?"
        result = await answer(context, text)
        assert result.reply
        assert "internal error" not in result.why
        if profile == "spec":
            reply = result.reply.decode()
            assert reply in KNOWN or reply.endswith(";")
        await finish(lab, context)

    lab.runner.run(run())


@given(st.lists(st.binary(max_size=300), max_size=20))
def test_text_is_cut_the_same_however_it_arrives(parts: list[bytes]) -> None:
    whole, pieces = LineSplitter(), LineSplitter()
    at_once = list(whole.feed(b"".join(parts)))
    bit_by_bit = [text for part in parts for text in pieces.feed(part)]
    assert at_once == bit_by_bit
    assert whole.flush() == pieces.flush()
    assert whole.pending == pieces.pending == 0
