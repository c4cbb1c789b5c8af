"""The main story in Firefox and in WebKit, the engine of Safari, where Debian's packages of them are installed."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import pytest

from tests.browser.engines.webdriver import INSTALL, Engine, click, hold, is_installed, let_go, press, started, until
from tests.browser.served import Served, becomes, is_driven

T = TypeVar("T")
pytestmark = [
    pytest.mark.asyncio(loop_scope="session"),
    pytest.mark.slow,  # two further browsers; all other files here do the same, and more, in Chromium
]
PICTURE = "[...document.querySelectorAll('.screen video, .screen img')].some(e => e.videoWidth || e.naturalWidth)"
ENTER, F5, ESCAPE = "\ue007", "\ue035", "\ue00c"
PRINTED = "window.studio.runner.printed.value.some(e => e.text === 'hello')"


async def beside(served: Served, what: Callable[[], T]) -> T:
    """Do what waits for a page on a thread, while robot time passes."""
    doing = asyncio.create_task(asyncio.to_thread(what))
    while not doing.done():
        await served.clock.advance(0.05)
        await asyncio.wait((doing,), timeout=0.05)
    return await doing


def sees(engine: Engine, address: str) -> None:
    """Open the console and its camera."""
    engine.go(f"{address}/#/live")
    until(engine, "document.querySelector('.link.good') && document.querySelector('#tab-drive')")
    engine.ask("localStorage.language = 'en'; localStorage.person = 'anna'")
    click(engine, "#tab-drive")
    click(engine, "figure .button")
    until(engine, PICTURE)


def programs(engine: Engine, address: str) -> None:
    """Find a block, put it down by keyboard, and run it."""
    engine.go(f"{address}/studio/")
    until(engine, "window.studio?.editor.workspace && document.querySelector('.button.main:enabled')")
    click(engine, ".search input")
    press(engine, *"print")
    until(engine, "document.querySelector('.blocklyFlyout .blocklyDraggable')")
    press(engine, ENTER)
    until(engine, "document.activeElement.closest('.blocklyFlyout')")
    press(engine, ENTER, ENTER)
    until(engine, "window.studio.editor.code.value.includes(\"print('hello')\")")
    press(engine, F5)
    until(engine, PRINTED)


@pytest.mark.parametrize("name", ["firefox", "webkit"])
async def test_pupil_drives_looks_and_programs(name: str, served: Served, tmp_path: Path) -> None:
    if not os.environ.get("ROBOGLOT_TESTS_ENGINES"):
        pytest.skip("takes minutes on a busy machine: ROBOGLOT_TESTS_ENGINES=1 has it run")
    if not is_installed(name):
        pytest.skip(f"no {name} here (Debian: {INSTALL[name]})")
    console = served.runtime.console
    assert console is not None
    await console.ready()
    engine = await asyncio.to_thread(started, name, tmp_path)
    try:
        await beside(served, partial(sees, engine, console.address))
        for finger in ("mouse", "touch"):
            await asyncio.to_thread(hold, engine, ".pad", 60, finger)
            await becomes(lambda: asyncio.sleep(0, is_driven(served.robot)), True)
            await asyncio.to_thread(let_go, engine, finger)
            await becomes(lambda: asyncio.sleep(0, is_driven(served.robot)), False)
        await beside(served, partial(programs, engine, console.address))
        await asyncio.to_thread(press, engine, ESCAPE)
    finally:
        await asyncio.to_thread(engine.close)
