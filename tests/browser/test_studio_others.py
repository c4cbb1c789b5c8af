"""Several programs on one robot in Chromium: each page lights its own, and shows how many others run."""

from __future__ import annotations

import json

import pytest

from tests.browser.served import shows, until
from tests.browser.test_studio import COUNTING, FOREVER, Open, loaded, studio

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")


@pytest.mark.slow  # long; tests/console/test_studio_socket.py has the lists
async def test_other_programs_are_counted_listed_first_and_ended(studio: Open) -> None:
    page, other = await loaded(await studio(), FOREVER), await loaded(await studio(), FOREVER)
    await page.fill("header .name input", "mine")
    await page.keyboard.press("Enter")
    await until(page, "document.querySelector('.stored').textContent === 'Kept on the robot'")
    await other.fill("header .name input", "the other")
    await other.keyboard.press("Enter")
    await other.keyboard.press("F5")
    await until(page, "document.querySelector('.controls .count')?.textContent === '1'")
    assert await other.query_selector(".controls .count") is None
    await page.wait_for_selector(".controls [role=status]:text-is('Other programs run on this robot: 1')")  # is read
    button = page.get_by_role("button", name="Other programs run on this robot: 1")
    before = await page.evaluate("document.querySelector('.workspace').clientHeight")
    await button.click()
    first = page.locator("dialog .rows li").first
    await until(page, "document.querySelector('dialog .rows b')?.textContent === 'the other'")
    await other.fill("header .name input", "renamed")  # the robot takes it when its program has ended
    await other.keyboard.press("Enter")
    await first.get_by_role("button", name="End").click()
    await until(page, "!document.querySelector('.controls .count')")
    await until(other, "studio.runner.phase.value === 'idle'")
    await shows(page, "document.querySelector('.workspace').clientHeight", before)  # nothing moved
    await until(page, "[...document.querySelectorAll('dialog .rows b')].some(name => name.textContent === 'renamed')")
    assert page.errors == other.errors == []


async def test_line_of_the_lit_block_stays_marked(studio: Open) -> None:
    page = await loaded(await studio(), FOREVER)
    marked = "[...document.querySelectorAll('.python .here')].map(line => line.dataset.of).join()"
    await page.keyboard.press("F5")
    await until(page, f"{marked} === 'count'")
    await page.evaluate("studio.editor.toggleBreak('always')")  # the lines are rendered anew
    await until(page, "document.querySelector('.python .gutter.on')")
    await shows(page, marked, "count")
    await page.click("#tab-output")
    await page.click("#tab-python")
    await until(page, f"{marked} === 'count'")
    await page.keyboard.press("Shift+F5")
    await until(page, f"{marked} === ''")
    assert await page.query_selector(".value-bubble") is None  # a waiting program answers nothing
    assert page.errors == []


@pytest.mark.slow  # in every look; in one: test_studio.py
async def test_values_fit_in_bubbles_in_every_look(studio: Open) -> None:
    named = json.dumps(COUNTING).replace('"name": "n"', '"name": "distance of the wall"')
    page = await loaded(await studio(), json.loads(named))
    over = """[...document.querySelectorAll('.value-bubble')].map(one => {
        const [box, words] = [...one.children].map(part => part.getBoundingClientRect());
        return Math.max(words.right - box.right, box.left - words.left);
    })"""
    for look in ("plain", "contrast", "dyslexia"):
        await page.select_option(".looks select", look)
        await page.evaluate("studio.editor.toggleBreak('say')")
        await page.keyboard.press("F5")
        await until(page, "studio.runner.phase.value === 'paused' && document.querySelector('.value-bubble')")
        await until(page, f"{over}.every(out => out <= 0)")
        await page.keyboard.press("Shift+F5")
        await until(page, "studio.runner.phase.value === 'idle'")
        await page.evaluate("studio.editor.toggleBreak('say')")
    assert page.errors == []


async def test_names_keep_their_letters_in_python(studio: Open) -> None:
    page = await studio()
    bubble = "document.querySelector('.value-bubble[data-of=more] text')?.textContent"
    for name, python in {"分数": "分数", "größe 1": "größe_1", "print": "print2", "🐶": "my__"}.items():
        await loaded(page, json.loads(json.dumps(COUNTING).replace('"name": "n"', f'"name": "{name}"')))
        await page.evaluate("studio.editor.breaks.value.includes('say') || studio.editor.toggleBreak('say')")
        await page.keyboard.press("F5")
        await until(page, f"{bubble} === '{name} = 6'")
        assert f"{python} = " in await page.evaluate("studio.editor.code.value")
        await page.keyboard.press("Shift+F5")
        await until(page, "studio.runner.phase.value === 'idle'")
    assert page.errors == []
