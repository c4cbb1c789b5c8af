"""Every block: what it writes passes the checker and calls the robot with the same values, in the real jail."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Call, ExitReason, Failed, Finished, Limits
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.functions.table import ABILITIES, bind
from roboglot.programs.language import check
from roboglot.programs.worker.values import Record
from roboglot.wire.contracts import contract
from tests.browser.served import Served, until

pytestmark = pytest.mark.asyncio(loop_scope="session")
SCRIPT = Path(__file__).with_name("round_trip.js").read_text("utf-8").partition("\n")[2]
TOGETHER = Path(__file__).with_name("loaded_together.js").read_text("utf-8").partition("\n")[2]
ENDLESS = {"forever"}
REFUSALS = {"IndexError", "AttributeError", "TypeError", "ZeroDivisionError", "ValueError"}
EMPTY = {
    "lists_getIndex",
    "lists_setIndex",
    "field_of",
    "field_set",
    "math_on_list",
}


@pytest_asyncio.fixture(scope="module", loop_scope="session")
async def page(opened: Served, browser: Any) -> AsyncIterator[Any]:
    console = opened.runtime.console
    assert console is not None
    await console.ready()
    page = await browser.new_page()
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    await page.goto(f"{console.address}/studio/")
    await until(page, "window.studio && studio.editor.workspace")
    page.said = said
    yield page
    await page.close()


@pytest_asyncio.fixture(scope="module", loop_scope="session")
async def played(page: Any) -> dict[str, Any]:
    """Return the page's programs for every block."""
    return {**await page.evaluate(SCRIPT), "said": page.said}


@pytest_asyncio.fixture(scope="module", loop_scope="session")
async def engine() -> AsyncIterator[Engine]:
    async with Engine() as engine:
        yield engine


@pytest.mark.slow  # long; each block is run below
async def test_functions_are_called_with_their_block_s_values(played: dict[str, Any], engine: Engine) -> None:
    assert played["functions"] == len(list(contract("visual"))) == 169
    assert check(played["code"], ability_set().names()) == []
    run = await engine.start(played["code"], ability_set(), Limits())
    calls: list[tuple[str, dict[str, Any]]] = []
    async for event in run:
        match event:
            case Call(name=name, args=args, kwargs=kwargs):
                operation = ABILITIES.get(name)
                assert operation is not None
                calls.append((name, bind(operation, args, kwargs)))
                run.calls.reply(event.id, None)
            case Failed() | Finished():
                assert event == Finished()
    made = [call for call in calls if not _is_mark(call)]
    assert [name for name, _ in made] == [name for name, _ in played["calls"]]
    for (name, values), (_, wanted) in zip(made, played["calls"], strict=True):
        assert {key: _plain(value) for key, value in values.items()} == wanted, name


async def test_reopened_blocks_write_the_same_program(played: dict[str, Any]) -> None:
    assert played["code"] == played["again"]
    assert played["said"] == []


@pytest.mark.slow  # draws everything twice
async def test_quick_loading_draws_the_same_blocks(page: Any) -> None:
    found = await page.evaluate(TOGETHER)
    assert found["elements"] > 1000
    assert found["moved"] == []
    assert found["unlike"] == []
    assert all(found["connected"])


@pytest.mark.slow
async def test_each_block_of_the_language_runs(played: dict[str, Any], engine: Engine) -> None:
    assert len(played["language"]) > 70
    for kind, code in played["language"]:
        assert check(code, ability_set().names()) == [], (kind, code)
        ending = await _ending(engine, code, 0.5 if kind in ENDLESS else 0.0)
        if kind in ENDLESS:
            assert isinstance(ending, Failed), (kind, code)
            assert ending.reason is ExitReason.CPU or ending.reason is ExitReason.WALL, (kind, ending)
        elif kind in EMPTY and isinstance(ending, Failed):
            assert ending.type in ("IndexError", "AttributeError", "TypeError", "ZeroDivisionError", "ValueError"), (
                ending
            )
        else:
            assert ending == Finished(), (kind, code)


async def _ending(engine: Engine, code: str, wall: float = 0.0) -> Finished | Failed:
    run = await engine.start(code, ability_set(), Limits(wall=wall), seed=1)
    ending: Finished | Failed | None = None
    async for event in run:
        match event:
            case Call(name=name):
                run.calls.reply(event.id, 1.0 if name.startswith("time.") else None)
            case Failed() | Finished():
                ending = event
    assert ending is not None
    return ending


def _is_mark(call: tuple[str, dict[str, Any]]) -> bool:
    """Return whether the call is the mark before a block: its id is one of the editor's."""
    name, values = call
    return name == "cyberdog.task.block" and len(values["id"]) == 20 and values["id"].isalnum()


def _plain(value: object) -> object:
    return value.type if isinstance(value, Record) else value
