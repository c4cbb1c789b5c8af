"""Modules are written in blocks: kept from a function, called by other programs, shown from inside, opened again."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.served import Served, becomes, shows, until
from tests.browser.test_studio import Open, Page, loaded, phase, prints, studio
from tests.narrowing import known

__all__ = ["studio"]
pytestmark = pytest.mark.asyncio(loop_scope="session")


def call(id: str, kind: str, **more: Any) -> dict[str, Any]:
    value = {"ARG0": {"shadow": {"type": "math_number", "fields": {"NUM": 21}}}}
    state = {"name": "double", "params": ["x"]}
    return {"type": f"procedures_call{kind}", "id": id, "extraState": state, "inputs": value, **more}


X = {"type": "variables_get", "fields": {"VAR": {"id": "varx"}}}
DOUBLE = {
    "variables": [{"name": "x", "id": "varx"}],
    "blocks": {"languageVersion": 0, "blocks": [
        {
            "type": "procedures_defreturn", "id": "def", "x": 420, "y": 60, "fields": {"NAME": "double"},
            "extraState": {"params": [{"name": "x", "id": "varx"}]},
            "inputs": {
                "STACK": {"block": {"type": "wait", "id": "inner", "inputs": {"SECONDS": {"block": dict(X)}}}},
                "RETURN": {"block": {"type": "math_arithmetic", "id": "sum", "fields": {"OP": "ADD"},
                                     "inputs": {"A": {"block": dict(X)}, "B": {"block": dict(X)}}}},
            },
        },
        {"type": "text_print", "id": "say", "x": 30, "y": 60,
         "inputs": {"TEXT": {"block": call("call", "return")}}},
    ]},
}  # fmt: skip


async def kept_as_module(page: Page) -> None:
    """Use the menu of the function's block, as a person does."""
    block = page.locator("[data-id=def] > .blocklyPath").first
    await block.click(button="right", position={"x": 12, "y": 12})
    await page.click("text=Keep as a module")
    await until(page, "!studio.editor.code.value.includes('def ')")
    await until(page, "studio.editor.modules.value.some(m => m.condition.startsWith('double'))")


@pytest.mark.slow  # long; in short: test_stepping_goes_through_the_blocks_of_a_module
async def test_function_becomes_a_module_that_is_lit_inside(studio: Open, opened: Served) -> None:
    page = await loaded(await studio(), DOUBLE)
    await kept_as_module(page)
    assert "double(21)" in await page.evaluate("studio.editor.code.value")
    await page.click("text=Run")
    await until(page, "studio.runner.lit.value === 'inner'")
    await until(page, "document.querySelector('.inside .lit')?.dataset.id === 'inner'")
    await until(page, "document.querySelector('.inside b').innerText.includes('double')")
    await until(page, "studio.runner.phase.value === 'running'")
    await opened.clock.advance(22.0)
    await phase(page, "idle")
    await prints(page, "42")
    await page.wait_for_selector(".inside", state="hidden")
    assert page.errors == []


async def test_stepping_goes_through_the_blocks_of_a_module(studio: Open, opened: Served) -> None:
    page = await loaded(await studio(), DOUBLE)
    await kept_as_module(page)
    await page.keyboard.press("F8")
    await phase(page, "paused")
    await shows(page, "studio.runner.lit.value", "say")
    for block in ("def", "inner"):
        await page.keyboard.press("F8")
        await until(page, f"studio.runner.lit.value === '{block}' && studio.runner.phase.value === 'paused'")
        await until(page, f"document.querySelector('.inside .lit')?.dataset.id === '{block}'")
    await page.keyboard.press("Shift+F5")
    await phase(page, "idle")
    assert page.errors == []


@pytest.mark.slow  # long; the others of this file show a module
async def test_a_module_is_opened_changed_and_deleted(studio: Open, opened: Served) -> None:
    page = await loaded(await studio(), DOUBLE)
    await kept_as_module(page)
    await page.click("text=Programs")
    row = page.locator("dialog li", has_text="double(x)")
    await row.locator("text=Open").click()
    await until(page, "studio.editor.code.value.includes('def double(x)')")
    await page.evaluate("studio.editor.workspace.getBlockById('sum').setFieldValue('MULTIPLY', 'OP')")
    await until(page, "studio.editor.code.value.includes('x * x')")
    await page.locator(".blocklyDraggable > .blocklyPath").first.click(button="right", position={"x": 12, "y": 12})
    await page.click("text=Keep as a module")
    service = next(iter(opened.runtime._programs.values())).service

    async def squares() -> bool:
        return "x * x" in known(await service.library.get("double")).body

    await becomes(squares, True)
    await until(page, "studio.program.value.module === 'double'")
    await page.click("text=Programs")
    await row.locator("text=Open").click()
    await until(page, "studio.editor.code.value.includes('x * x')")
    await page.click("text=Programs")
    page.on("dialog", lambda dialog: dialog.accept())
    await row.locator("text=Delete").click()
    await page.wait_for_selector("text=is called by My program")  # the first of those above
    for task in await service.tasks():
        await service.delete(task.id)
    await row.locator("text=Delete").click()
    await until(page, "!studio.editor.modules.value.length")
    assert page.errors == []
