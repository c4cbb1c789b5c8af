"""The language: programs and what CPython prints for them, run by the real worker with all its checks."""

from pathlib import Path

import pytest

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Finished
from tests.programs.playing import play

CASES = {path.stem: path.read_text("utf-8") for path in sorted((Path(__file__).parent / "cases").glob("*.py"))}
PRINTED = {path.stem: path.read_text("utf-8") for path in (Path(__file__).parent / "cases").glob("*.out")}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.asyncio(loop_scope="module")
async def test_prints_what_python_prints(engine: Engine, case: str) -> None:
    played = await play(engine, CASES[case])
    assert played.output == PRINTED[case]
    assert played.ending == Finished()
