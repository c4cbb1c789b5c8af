"""Opening of the stage: kernels are compiled apart first, and nothing delays the program's end."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from pathlib import Path
from unittest.mock import Mock

import pytest

from roboglot.kernels import CAMERA, MODULES
from roboglot.kernels.ahead import KernelsUnavailable
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.simulation import rendering
from roboglot.simulation.rendering import render_pool
from roboglot.simulation.rendering.render_pool import RenderPool
from roboglot.simulation.rendering.views import Scenery


@pytest.mark.parametrize("compiles", [True, False])
async def test_first_picture_has_its_kernels_compiled_apart(compiles: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the pool's threads, compiling halved the robots' speed, and Ctrl-C ended with 1 after ten seconds."""
    done: list[object] = []

    async def compile_beside(names: Sequence[str]) -> None:
        done.extend((names, "the kernels that draw it are compiled" in opened.delay))
        if not compiles:
            raise KernelsUnavailable("the disk is full")

    def open_stage() -> Scenery:
        done.append(threading.current_thread().daemon)  # others are waited for at the end
        return Mock(spec=Scenery)

    monkeypatch.setattr(render_pool, "compile_beside", compile_beside)
    monkeypatch.setattr(render_pool, "missing", lambda names: names)
    opened = RenderPool(open_stage, RealClock())
    assert await opened.stage() is await opened.stage()
    assert done == [CAMERA, True, True]
    assert not opened.delay


async def test_stage_opens_in_place_in_lockstep(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render_pool, "compile_beside", Mock(side_effect=AssertionError))
    here = threading.get_ident()
    stage = await RenderPool(lambda: Mock(opened_in=threading.get_ident()), LockstepClock()).stage()
    assert vars(stage)["opened_in"] == here


def test_kernels_of_pictures_are_all_listed() -> None:
    texts = [path.read_text("utf-8") for path in Path(rendering.__file__).parent.glob("*.py")]
    imported = {name for text in texts for name in re.findall(r"from roboglot\.kernels\.(\w+) import", text)}
    assert imported & {*MODULES} == {*CAMERA}
