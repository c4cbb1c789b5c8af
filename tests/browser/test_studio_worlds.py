"""A class of two worlds in real pages; one program on two devices."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from roboglot.shards.classes import FleetClasses
from roboglot.testing.addresses import free_addresses
from tests.browser.served import Served, shows, until
from tests.browser.test_studio import FOREVER, READY, Open, loaded, phase, studio
from tests.console.conftest import ServedConsole
from tests.console.test_classes import world

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")
Page = Any


@pytest_asyncio.fixture(loop_scope="session")
async def worlds(tmp_path: Path) -> AsyncIterator[list[ServedConsole]]:
    """Two worlds that share a classroom, as ``roboglot fleet up --worlds 2`` has them."""
    classes = FleetClasses(tmp_path)
    await classes.open()
    async with world(tmp_path, "w1", free_addresses(1)) as first, world(tmp_path, "w2", free_addresses(1)) as second:
        yield [first, second]
    await classes.close()


@asynccontextmanager
async def pages(browser: Any, *addresses: str) -> AsyncIterator[list[Page]]:
    """Yield a page of the studio at each address, each in a browser of its own."""
    contexts = [await browser.new_context(viewport={"width": 1400, "height": 900}) for _ in addresses]
    opened = []
    for context, address in zip(contexts, addresses, strict=True):
        await context.add_init_script("localStorage.language ??= 'en'; localStorage.theme ??= 'light'")
        page = await context.new_page()
        page.errors = []
        page.on("pageerror", lambda error, page=page: page.errors.append(str(error)))
        await page.goto(f"{address}/studio/")
        await until(page, READY)
        opened.append(page)
    yield opened
    for context in contexts:
        await context.close()


async def joins(page: Page, code: str, name: str) -> None:
    """Join on whichever world it leads to."""
    await page.click("#tab-group")
    await page.fill("input[name=code]", code.lower())
    await page.fill("form:nth-of-type(1) input[name=name]", name)
    await page.click("form:nth-of-type(1) button")
    while True:  # the page may switch to another world meanwhile
        with contextlib.suppress(Exception):
            if await page.evaluate(f"document.querySelector('#panel')?.textContent.includes('You are {name}')"):
                return
        await asyncio.sleep(0.05)


@pytest.mark.slow  # long; a class: test_studio_class.py
async def test_two_pupils_in_worlds_of_their_own(browser: Any, worlds: list[ServedConsole]) -> None:
    first, second = worlds
    async with pages(browser, first.url, first.url, first.url) as (teacher, anna, ben):
        await teacher.click("#tab-group")
        await teacher.fill("form:nth-of-type(2) input[name=name]", "7b")
        await teacher.click("form:nth-of-type(2) button")
        await until(teacher, "document.querySelector('.code')")
        code = await teacher.inner_text(".code")
        async with asyncio.timeout(120):
            await joins(anna, code, "Anna")
            await joins(ben, code, "Ben")
        assert [page.url.rstrip("/") for page in (anna, ben)] == [f"{shown.url}/studio" for shown in (first, second)]
        for pupil in (anna, ben):
            await until(pupil, READY)
            await loaded(pupil, FOREVER)
            await pupil.keyboard.press("F5")
            await phase(pupil, "running")
            await until(pupil, "studio.runner.lit.value === 'count'")
        words = json.dumps(await anna.evaluate("studio.editor.workspace.getBlockById('count').toString(60)"))
        for name, where in (("Anna", "w1"), ("Ben", "w2")):
            rows = "[...document.querySelectorAll('.pupils li')].map(row => row.textContent)"
            await until(
                teacher, f"{rows}.some(t => t.includes('{name}') && t.includes('{where}') && t.includes({words}))"
            )
        await until(teacher, "document.querySelectorAll('.pupils img.map').length === 2")
        await teacher.click("#panel .button.danger")  # stop all
        await phase(anna, "idle")
        await phase(ben, "idle")
        assert [page.errors for page in (teacher, anna, ben)] == [[], [], []]


@pytest.mark.slow  # long; in short: tests/console/test_studio_socket.py
async def test_two_devices_show_one_program_alike(studio: Open, opened: Served) -> None:
    """Another browser with another name and language opens the program that runs: same blocks, state, lit block."""
    phone, desk = await studio(person="anna"), await studio(person="ben", language="zh")
    await loaded(phone, FOREVER)
    await phone.fill(".name input", "Shared")
    await phone.keyboard.press("Tab")
    await phone.keyboard.press("F5")
    await phase(phone, "running")
    await until(phone, "studio.runner.lit.value === 'count'")
    await desk.click("button:has-text('程序')")
    await desk.click("dialog li:has-text('Shared') button >> nth=0")
    await phase(desk, "running")
    await until(desk, "studio.runner.lit.value === 'count' && document.querySelector('.lit')?.dataset.id === 'count'")
    blocks = "JSON.stringify(studio.editor.save().blocks)"
    await shows(desk, blocks, await phone.evaluate(blocks))
    await desk.keyboard.press("F6")
    for page in (desk, phone):
        await phase(page, "paused")
        await shows(page, "studio.runner.lit.value", "count")
    await phone.keyboard.press("Shift+F5")
    await phase(desk, "idle")
    await phase(phone, "idle")
    assert [page.errors for page in (phone, desk)] == [[], []]
