"""Lookup of functions: names, arguments, states, logs, tasks and time."""

from __future__ import annotations

import pytest

from roboglot.programs.functions.prelude import ability_set, implemented
from roboglot.programs.functions.session import TaskEnded
from roboglot.programs.functions.table import ABILITIES, SPELLINGS, TIME, bind
from roboglot.wire.contracts import contract
from tests.programs.functions.calling import Caller, field


def test_every_function_is_one_of_the_manuals() -> None:
    names = {row.key for row in contract("visual")}
    assert {operation.key for operation in ABILITIES} <= names
    assert implemented() <= names
    assert set(SPELLINGS.values()) <= names
    prelude = ability_set()
    assert names | set(SPELLINGS) == prelude.calls | prelude.attributes


def test_everything_has_a_docstring_for_the_reference() -> None:
    assert [operation.key for operation in ABILITIES if not operation.summary] == []


@pytest.mark.parametrize(
    ("args", "kwargs", "words"),
    [
        ((1, 2, 3), {}, "takes at most 2 arguments"),
        ((1,), {"angle": 2}, "multiple values for argument 'angle'"),
        ((), {"angel": 2}, "unexpected keyword argument 'angel'"),
        (("left",), {}, "angle must be a number, not text"),
        ((None,), {}, "angle must be a number, not None"),
        (([90],), {}, "angle must be a number, not a list"),
    ],
)
async def test_arguments_bind_as_in_python(
    bare_caller: Caller, args: tuple[object, ...], kwargs: dict[str, object], words: str
) -> None:
    with pytest.raises(TypeError, match=words):
        await bare_caller("cyberdog.motion.turn", *args, **kwargs)


@pytest.mark.parametrize(("kind", "value"), [("int", "7"), ("float", "7"), ("bool", "1"), ("int", 7.0), ("str", 7)])
def test_no_function_converts_arguments(kind: str, value: object) -> None:
    """The robot's bindings of C++ make no number of a text, and no whole one of another."""
    tried = 0
    for operation in (*ABILITIES, *TIME):
        for name in operation.names:
            if operation.handler.__annotations__[name] == kind:
                tried += 1
                with pytest.raises(TypeError, match=rf"{name} must be"):
                    bind(operation, (), {name: value})
    assert tried


def test_truth_values_are_numbers_and_the_reverse() -> None:
    turn, log = (next(found for found in ABILITIES if found.key == f"cyberdog.motion.{n}") for n in ("turn", "set_log"))
    assert bind(turn, (True,), {})["angle"] == 1.0
    assert bind(log, (1,), {}) == {"log": True}


async def test_huge_numbers_are_refused_like_any_other(bare_caller: Caller) -> None:
    for angle in (10**400, -(2**70), 1e308):
        try:
            result = await bare_caller("cyberdog.motion.turn", angle)
        except (TypeError, OverflowError):
            continue
        assert field(result, "response.code") == 3010


async def test_missing_function_is_reported(bare_caller: Caller) -> None:
    with pytest.raises(NotImplementedError, match=r"cyberdog.skin.shine is not built yet"):
        await bare_caller("cyberdog.skin.shine", "anna")


async def test_logs_are_switched_per_group_and_together(bare_caller: Caller) -> None:
    assert field(await bare_caller("cyberdog.motion.set_log", True), "code") == 0
    await bare_caller("cyberdog.motion.turn", 400, duration=2)
    await bare_caller("cyberdog.motion.set_log", log=False)
    await bare_caller("cyberdog.motion.turn", 400)
    assert bare_caller.written[0].startswith("cyberdog.motion.turn(400, duration=2): angle = 400 is outside")
    written = len(bare_caller.written)
    await bare_caller("cyberdog.set_log", True)
    await bare_caller("cyberdog.task.block", "a")
    assert bare_caller.written[written:] == ["cyberdog.task.block('a'): success"]


async def test_blocks_breakpoints_and_ends(bare_caller: Caller) -> None:
    await bare_caller("cyberdog.block", "a")
    await bare_caller("cyberdog.task.breakpoint_block", "b")
    assert (bare_caller.blocks, bare_caller.breakpoints) == (["a", "b"], 1)
    for name in ("start", "recover"):
        assert field(await bare_caller(f"cyberdog.task.{name}"), "code") == 0
    for name in ("cyberdog.task.stop", "cyberdog.shutdown"):
        with pytest.raises(TaskEnded):
            await bare_caller(name)
    with pytest.raises(ValueError, match="at most 256"):
        await bare_caller("cyberdog.task.block", "x" * 257)
    with pytest.raises(ValueError, match="at most 256"):
        await bare_caller("cyberdog.task.block", "\ud800")


async def test_failed_call_colours_the_blocks_until_one_succeeds(caller: Caller) -> None:
    await caller("cyberdog.motion.turn", 400)
    await caller("cyberdog.task.block", "a")
    assert field(caller.session.last_state, "code") == 1
    await caller("cyberdog.motion.set_log", True)
    assert field(caller.session.last_state, "code") == 1
    await caller("cyberdog.motion.turn", 0)
    assert field(caller.session.last_state, "code") == 0


async def test_time_is_the_robots(bare_caller: Caller) -> None:
    clock = bare_caller.clock
    assert await bare_caller("time.time") == clock.epoch()
    start = await bare_caller("time.monotonic")
    assert await bare_caller("time.sleep", 2.5) is None
    assert clock.time() - start == pytest.approx(2.5, abs=0.03)
    assert await bare_caller("time.sleep", 0) is None
    for seconds, error in ((-1, ValueError), (float("nan"), ValueError), (float("inf"), OverflowError)):
        with pytest.raises(error):
            await bare_caller("time.sleep", seconds)
    with pytest.raises(TypeError):
        await bare_caller("time.sleep")
