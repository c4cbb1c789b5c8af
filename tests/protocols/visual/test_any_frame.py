"""Frames that are none, and any frame at all: each gets an answer."""

from __future__ import annotations

import asyncio
import json

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.model.robot import Description, Robot
from roboglot.programs.tasks.states import TaskOperation
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from tests.protocols.visual.front_end import FrontEnd

TEXTS = dict.fromkeys(("maker", "model", "serial", "hardware_version", "software_version"), "")
UNKNOWN = Description(**TEXTS, radius=0.2, height=0.3)


async def test_frames_that_are_none(app: FrontEnd) -> None:
    await app.door.receive("{")
    assert app.frames[-1] == {
        "feedback": {
            "type": "parse",
            "id": "",
            "target_id": "",
            "operate": "",
            "state": 1,
            "describe": app.frames[-1]["feedback"]["describe"],
        }
    }
    [answer] = await app.ask("save", "../x", mode="single", condition="now", body="pass")
    assert (answer["state"], answer["type"], answer["target_id"]) == (4, "task", "../x")


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow], deadline=None, max_examples=60
)
@given(
    st.text(max_size=40)
    | st.fixed_dictionaries(
        {},
        optional={
            "type": st.sampled_from(["task", "module", "AI", "SLAM"]) | st.text(max_size=3),
            "id": st.text(max_size=5),
            "operate": st.sampled_from([*TaskOperation, "add"]),
            "target_id": st.lists(st.sampled_from(["t", "debug", "", "../x"]), max_size=3),
            "mode": st.sampled_from(["single", "cycle", "common", "map", "all", ""]),
            "condition": st.sampled_from(["now", "21:30", "f()", "* * * * *", ""]),
            "body": st.sampled_from(["pass", "if", "", "é"]) | st.integers(),
        },
    ).map(json.dumps)
)
def test_every_frame_gets_an_answer(text: str) -> None:
    async def ask() -> None:
        """A door whose service runs nothing: frames only."""
        door = FrontEndOnly()
        await door.receive(text)
        assert door.sent
        for sent in door.sent:
            [key] = set(json.loads(sent)) - {"block"}
            assert key in ("feedback", "response")

    asyncio.run(ask())


class FrontEndOnly:
    """A door over a service whose engine is never opened: bodies cannot be checked, so saving is refused."""

    def __init__(self) -> None:
        from roboglot.model.clock import LockstepClock
        from roboglot.programs.engine.engine import Engine
        from roboglot.programs.tasks.service import ProgramService
        from roboglot.protocols.visual.server import VisualDoor

        self.sent: list[str] = []
        engine = Engine()
        engine._closed = True
        robot = Robot("a", UNKNOWN, LockstepClock())
        self.database = Database(":memory:")
        self.door = VisualDoor(ProgramService(robot, engine, program_stores(self.database, robot.id)))
        self.door.subscribe(self.sent.append)

    async def receive(self, text: str) -> None:
        try:
            await self.door.receive(text)
        finally:
            self.database.close()
