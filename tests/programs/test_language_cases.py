"""The language: programs and what CPython prints for them, run by the real worker with all its checks."""

from pathlib import Path

import pytest
from playing import play

from roboglot.programs.engine import Engine
from roboglot.programs.events import Finished

CASES = sorted((Path(__file__).parent / "cases").glob("*.py"))


@pytest.mark.parametrize("case", CASES, ids=lambda path: path.stem)
@pytest.mark.asyncio(loop_scope="module")
async def test_prints_what_python_prints(engine: Engine, case: Path) -> None:
    played = await play(engine, case.read_text("utf-8"))
    assert played.output == case.with_suffix(".out").read_text("utf-8")
    assert played.ending == Finished()
