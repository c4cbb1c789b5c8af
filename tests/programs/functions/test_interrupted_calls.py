"""Calls cut off by the end of the server: a failure in the function's own words, and nothing moves."""

from __future__ import annotations

import ast
from types import SimpleNamespace
from typing import Any

import pytest

from roboglot.programs.engine.journal import does_something
from roboglot.programs.functions.enums import ENUMS
from roboglot.programs.functions.interrupted import CallInterrupted, call_cut_off
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.functions.results import StateCode
from roboglot.programs.functions.session import TaskEnded
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record
from tests.programs.functions.calling import Caller, field
from tests.programs.functions.examples import examples

WORDS = "the server ended while {} was under way; it was not repeated"
ACTING = sorted(operation.key for operation in ABILITIES if does_something(operation.key))
WITHOUT_STATE = {"choreographer.moonwalk", "choreographer.push_up", "dancer.dance"}
# Done already by the server's end: recognition is off, and a started program runs.
WITHOUT_ROBOT = {"cyberdog.gesture.turn_off_recognition", "cyberdog.skeleton.turn_off_recognition"}
WITHOUT_ROBOT |= {"cyberdog.task.start", "cyberdog.task.recover"}
_NAMES: dict[str, Any] = {name: SimpleNamespace(**members) for name, members in ENUMS.items()}
_NAMES |= {"true": True, "false": False, "MotionSequence": lambda: Record("MotionSequence", {"name": "s"})}


def arguments(name: str) -> tuple[list[object], dict[str, object]]:
    """Arguments of the function's example, which are valid."""
    for node in ast.walk(ast.parse(examples()[name].code)):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == name:
            try:
                args = [eval(ast.unparse(arg), dict(_NAMES)) for arg in node.args]
                return args, {word.arg or "": eval(ast.unparse(word.value), dict(_NAMES)) for word in node.keywords}
            except NameError:  # a variable of the example: only a sequence of steps
                return [_NAMES["MotionSequence"]()], {}
    raise AssertionError(f"the example of {name} does not call it")


async def test_each_function_reports_its_own_failure(caller: Caller) -> None:
    for name in ACTING:
        await cut_off(Caller(caller.robot, caller.clock), name)
        assert caller.robot.actions.running() == [], name
    assert caller.robot.actions.history == []


async def cut_off(caller: Caller, name: str) -> None:
    args, kwargs = arguments(name)
    caller.session.logging.add(name.split(".")[-2])
    words = WORDS.format(name)
    if name in ("cyberdog.task.stop", "cyberdog.shutdown"):  # ending is all it does
        with pytest.raises(TaskEnded):
            await call_cut_off(caller.session, name, args, kwargs)
        return
    if name in WITHOUT_STATE:
        with pytest.raises(CallInterrupted, match=words):
            await call_cut_off(caller.session, name, args, kwargs)
        assert caller.session.last_state.fields["describe"] == words
        return
    result = await call_cut_off(caller.session, name, args, kwargs)
    assert isinstance(result, Record), name
    outcome = result if result.type == "State" else field(result, "state")
    assert caller.session.states[name.split(".")[-2]] == outcome, name
    if name in WITHOUT_ROBOT:
        assert outcome.fields["code"] == StateCode.SUCCESS, name
    else:
        assert outcome.fields == {"code": StateCode.SPIN_FUTURE_INTERRUPTED, "describe": words}
        assert not succeeded(result), name
        assert any(text.endswith(words) for text in caller.written), name


def succeeded(result: Record) -> bool:
    """Return whether the result's own field says that it went well."""
    match getattr(result.fields.get("response"), "fields", {}):
        case {"result": bool(well)} | {"success": bool(well)}:
            return well
        case {"result": number}:
            return number == 0
        case {"code": code}:
            return code == 0
        case {"status": status}:
            return status == 0
    return False


async def test_motions_keep_their_number(caller: Caller) -> None:
    result = await call_cut_off(caller.session, "cyberdog.motion.turn", [90], {})
    usual = await caller("cyberdog.motion.turn", 1000)
    for reported in (result, usual):
        assert isinstance(reported, Record)
        assert field(reported, "response.motion_id") == field(usual, "response.motion_id") != 0
    assert (field(result, "response.result"), field(result, "response.code")) == (False, 3029)


async def test_the_robots_own_calls_are_not_touched(caller: Caller) -> None:
    """Earlier results are still there, and later calls work."""
    await call_cut_off(caller.session, "cyberdog.motion.turn", [90], {})
    assert field(await caller("cyberdog.motion.turn", 10), "state.code") == StateCode.SUCCESS
    assert ability_set().calls >= WITHOUT_STATE
