"""Programs that move a robot while a person stops it: a page's stop, a teacher's lock and reset end them all."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.model.components.motion.base import Base
from tests.console.conftest import ServedConsole
from tests.console.test_teaching import taught

__all__ = ["taught"]  # the fixture
ROUND = "while True:\n    cyberdog.motion.turn(90, 3)\n"
HALTED, TAUGHT = "ended by Stop", "ended by the teacher"


async def turns_round(served: ServedConsole) -> None:
    """Have robot a turn by a program."""
    assert (await served.ask("/api/robots/a/program", {"source": ROUND}))[0] == 200
    while abs(served.robot[Base].velocity.yaw) < 0.1:
        await served.clock.advance(0.1)


async def stopped(served: ServedConsole, path: str, wish: dict[str, str]) -> tuple[int, object]:
    """Answer a wish that needs time: the robot brakes."""
    asking = asyncio.create_task(served.ask(path, wish))
    while not asking.done():
        await served.clock.advance(0.1)
        await asyncio.sleep(0)
    return await asking


async def stands(served: ServedConsole, why: str) -> None:
    """Assert that the program has ended for this reason, and that nothing moves the robot any more."""
    await served.clock.advance(5.0)
    assert not [action.name for action in served.robot.actions.running()]
    assert abs(served.robot[Base].velocity.yaw) < 0.01
    _, program = await served.ask("/api/robots/a/program")
    assert (program["state"], program["log"][-1]["text"]) == ("shutdown", why)


async def test_stop_ends_programs_that_move_it(served: ServedConsole) -> None:
    await turns_round(served)
    assert await stopped(served, "/api/robots/a/stop", {}) == (200, {"result": None})
    await stands(served, HALTED)
    await turns_round(served)  # it may be started again


async def test_wrong_stop_ends_no_program(served: ServedConsole) -> None:
    await turns_round(served)
    assert (await served.ask("/api/robots/a/stop", {"now": "yes"}))[0] == 400
    assert (await served.ask("/api/robots/a/program"))[1]["state"] == "run"


@pytest.mark.parametrize("do", ["lock", "reset"])
async def test_teacher_ends_programs_that_move_robots(taught: ServedConsole, do: str) -> None:
    await turns_round(taught)
    assert (await stopped(taught, "/api/class", {"do": do}))[0] == 200
    await stands(taught, TAUGHT)
    if do == "lock":
        refusal = await taught.ask("/api/robots/a/program", {"source": ROUND})
        assert refusal == (409, {"error": "the teacher has locked robot a"})
        assert (await stopped(taught, "/api/class", {"do": "unlock"}))[0] == 200
        await taught.clock.advance(5.0)
        assert not taught.robot.actions.running()
    await turns_round(taught)
