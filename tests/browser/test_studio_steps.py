"""Stepping in Chromium: into a function, over one, out of one, by key and button; in blocks and in text."""

from __future__ import annotations

import pytest

from tests.browser.served import Served, becomes, shows, until
from tests.browser.test_studio import COUNTING, Open, Page, loaded, phase, prints, studio

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")


def says(id: str, text: str) -> dict[str, object]:
    return {"type": "text_print", "id": id, "inputs": {"TEXT": {"shadow": {"type": "text", "fields": {"TEXT": text}}}}}


def calls(id: str, following: dict[str, object] | None = None) -> dict[str, object]:
    block: dict[str, object] = {"type": "procedures_callnoreturn", "id": id, "extraState": {"name": "greet"}}
    return block | ({"next": {"block": following}} if following else {})


GREETING = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {"type": "procedures_defnoreturn", "id": "greet", "x": 400, "y": 30, "fields": {"NAME": "greet"},
             "inputs": {"STACK": {"block": says("hi", "hi") | {"next": {"block": says("there", "there")}}}}},
            calls("once", calls("twice", says("end", "end"))) | {"x": 30, "y": 30},
        ],
    }
}  # fmt: skip
TEXT = "def greet():\n    print('hi')\n    print('there')\n\ngreet()\ngreet()\nprint('end')\n"


async def at(page: Page, block: str) -> None:
    await until(
        page, f"studio.runner.phase.value === 'paused' && document.querySelector('.lit')?.dataset.id === {block!r}"
    )


async def test_steps_go_over_functions_and_out_of_them(studio: Open) -> None:
    page = await loaded(await studio(), GREETING)
    over, out = page.locator("[aria-label^='Step over']"), page.locator("[aria-label^='Step out']")
    await becomes(over.is_disabled, True)
    await page.keyboard.press("F8")
    await at(page, "once")
    await page.keyboard.press("F10")
    await at(page, "twice")
    await prints(page, "hi", "there")
    await page.keyboard.press("F8")
    await at(page, "greet")
    await page.keyboard.press("F8")
    await at(page, "hi")
    await page.keyboard.press("Shift+F8")
    await at(page, "end")
    await prints(page, "hi", "there", "hi", "there")
    await over.click()
    await phase(page, "idle")
    await prints(page, "hi", "there", "hi", "there", "end")

    await page.keyboard.press("F8")
    await at(page, "once")
    await page.keyboard.press("F8")
    await at(page, "greet")
    await out.click()
    await at(page, "twice")
    await page.keyboard.press("Shift+F5")
    await phase(page, "idle")
    assert page.errors == []


async def test_text_is_stepped_by_lines(studio: Open) -> None:
    page = await studio()
    await page.click("text=Programs")
    await page.click("text=New, in Python")
    await page.wait_for_selector(".cm-content")
    await page.evaluate(f"import('/studio/program.js').then(p => p.show({{ kind: 'text', body: {TEXT!r} }}))")
    line = "studio.runner.phase.value === 'paused' && studio.runner.line.value"
    for key, number in (("F8", 1), ("F10", 5), ("F10", 6), ("F8", 2), ("Shift+F8", 7)):
        await page.keyboard.press(key)
        await until(page, f"({line}) === {number}")
    await page.keyboard.press("F10")
    await phase(page, "idle")
    await prints(page, "hi", "there", "hi", "there", "end")
    assert page.errors == []


async def test_reopened_page_shows_its_run_s_values(studio: Open, opened: Served) -> None:
    page = await loaded(await studio(), COUNTING)
    await page.keyboard.press("F5")
    await phase(page, "idle")
    await prints(page, "6", "9", "12")
    await opened.clock.advance(1.0)  # lines of an earlier run are known by their time
    await page.evaluate("studio.editor.toggleBreak('say')")
    for _ in range(2):
        await page.keyboard.press("F5")
        await at(page, "say")
    await page.reload()
    await until(page, "window.studio?.editor.workspace")
    await at(page, "say")
    await prints(page, "6")
    await shows(page, "studio.runner.variables.value.n", "9")
    await page.keyboard.press("Shift+F5")
    await phase(page, "idle")
    assert page.errors == []
