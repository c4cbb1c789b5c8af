"""Building in Chromium: blocks are joined by keyboard alone, from the first key of the page, and by mouse."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from tests.browser.served import shows, until
from tests.browser.test_studio import AXE, Open, Page, loaded, phase, put_down, studio

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")
TOOLBOX = "document.activeElement.classList.contains('blocklyToolboxCategoryContainer')"
MOVING = "studio.editor.workspace.isDragging()"
STACKS = "studio.editor.workspace.getTopBlocks().length"


def says(id: str, y: int) -> dict[str, object]:
    text = {"shadow": {"type": "text", "fields": {"TEXT": id}}}
    return {"type": "text_print", "id": id, "x": 40, "y": y, "inputs": {"TEXT": text}}


APART = {"blocks": {"languageVersion": 0, "blocks": [says("first", 40), says("second", 240)]}}
WRONG = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {"type": "text_print", "id": "bad", "inputs": {"TEXT": {"block": {
                "type": "math_modulo", "inputs": {
                    "DIVIDEND": {"shadow": {"type": "math_number", "fields": {"NUM": 64}}},
                    "DIVISOR": {"shadow": {"type": "math_number", "id": "zero", "fields": {"NUM": 0}}}}}}}}
        ],
    }
}  # fmt: skip


async def take_found(page: Page, words: str) -> None:
    """Search by keyboard, take what is found first and put it where it would go."""
    while not await page.evaluate("document.activeElement.type === 'search'"):
        await page.keyboard.press("Shift+Tab")
    await page.keyboard.press("Control+a")
    await page.keyboard.type(words)
    await until(page, "/^Blocks found: [1-9]/.test(document.querySelector('.search + [role=status]').textContent)")
    await page.keyboard.press("Enter")
    await until(page, "document.activeElement.closest('.blocklyFlyout')")
    await page.keyboard.press("Enter")
    await until(page, MOVING)
    await put_down(page)


async def test_blocks_are_found_and_joined_by_keyboard(studio: Open) -> None:
    page = await studio()
    await page.keyboard.press("Tab")
    await shows(page, "document.activeElement.textContent", "To the blocks")
    await page.keyboard.press("Enter")
    await until(page, TOOLBOX)
    for made_anew in ("remake()", "showModules()"):  # as modules and missions come from the robot
        assert await page.evaluate(f"(studio.editor.{made_anew}, {TOOLBOX})")
    await take_found(page, "print")
    await take_found(page, "print")
    await until(page, f"{STACKS} === 1 && studio.editor.code.value.split('print(').length === 3")
    assert page.errors == []


async def test_late_words_leave_the_keyboard_in_place(studio: Open) -> None:
    page, may_come = await studio(), asyncio.Event()

    async def late(route: Any) -> None:
        await may_come.wait()
        await route.continue_()

    await page.route("**/studio/words/zh.json", late)
    await page.focus("input[type=search]")
    await page.keyboard.type("print")
    await page.keyboard.press("Enter")
    await until(page, "document.activeElement.closest('.blocklyFlyout')")
    await page.evaluate("() => { window.first = document.activeElement; }")
    may_come.set()
    await until(page, "!first.isConnected")
    assert await page.evaluate("Boolean(document.activeElement.closest('.blocklyFlyout'))")
    await page.keyboard.press("Enter")
    await until(page, MOVING)
    await put_down(page)


ZERO = '[aria-label$="number: 0"]'


async def test_error_is_mended_by_keyboard(studio: Open) -> None:
    page = await loaded(await studio(), WRONG)
    await page.evaluate("document.querySelector('.skip').focus()")
    await page.keyboard.press("F5")
    await until(page, "studio.runner.failureWords.value === 'Something is divided by zero.'")
    await phase(page, "idle")
    await page.keyboard.press("Enter")
    await until(page, TOOLBOX)
    while not await page.evaluate("document.activeElement.classList.contains('blocklyWorkspaceSelectionRing')"):
        await page.keyboard.press("Tab")
    await page.keyboard.press("ArrowDown")
    await until(page, "document.activeElement.closest('.blocklyBlock')")
    await until(page, f"document.querySelector({ZERO!r})")  # names are made when the page has time
    for _ in range(12):
        if await page.evaluate(f"document.activeElement.matches({ZERO!r})"):
            break
        await page.keyboard.press("ArrowRight")
    await page.keyboard.press("Enter")
    await until(page, "document.activeElement.classList.contains('blocklyHtmlInput')")
    await page.keyboard.press("Control+a")
    await page.keyboard.type("10")
    await page.keyboard.press("Enter")
    await until(page, "studio.editor.code.value.includes('64 % 10')")
    await page.keyboard.press("F5")
    await until(page, "studio.runner.printed.value.at(-1)?.text === '4'")
    assert page.errors == []


async def test_the_focus_stays_when_blocks_move(studio: Open) -> None:
    page = await loaded(await studio(), APART)
    stays = """async () => {
        const { getFocusManager } = await import("/studio/vendor/blockly.mjs");
        const [first, second] = ["first", "second"].map((id) => studio.editor.workspace.getBlockById(id));
        const words = second.getInputTargetBlock("TEXT");
        first.bringToFront(); // which moves its neighbours a frame later
        getFocusManager().focusNode(words);
        for (let frame = 0; frame < 2; frame += 1) await new Promise(requestAnimationFrame);
        return document.activeElement === words.getFocusableElement();
    }"""
    assert await page.evaluate(stays)
    assert page.errors == []


async def test_block_is_joined_by_mouse(studio: Open) -> None:
    page = await loaded(await studio(), APART)
    path = "document.querySelector('[data-id={}] > .blocklyPath').getBoundingClientRect().toJSON()"
    below, moved = [await page.evaluate(path.format(id)) for id in ("first", "second")]
    await page.mouse.move(moved["x"] + 12, moved["y"] + 12)
    await page.mouse.down()
    await page.mouse.move(below["x"] + 24, below["bottom"] + 24, steps=8)
    await page.mouse.move(below["x"] + 16, below["bottom"] + 12, steps=4)
    await page.mouse.up()
    await until(page, f"{STACKS} === 1")
    assert page.errors == []


FOUND = "studio.editor.workspace.getToolbox().getFlyout().getWorkspace().getTopBlocks().map(b => b.type)"


@pytest.mark.slow  # in short: test_blocks_are_found_and_joined_by_keyboard
async def test_language_blocks_are_found_in_both_languages(studio: Open) -> None:
    page = await studio(language="zh")
    wanted = {"如果": "controls_if", "循环": "forever", "变量": "variables_set", "函数": "procedures_defnoreturn"}
    for words, block in (wanted | {"while": "controls_whileUntil", "sleep": "wait"}).items():
        await page.fill("input[type=search]", words)
        await until(page, f"{FOUND}.includes({block!r})")
    await page.fill("input[type=search]", "if")
    await until(page, f"{FOUND}[0] === 'controls_if' && !{FOUND}.some(type => type.includes('lift'))")
    await page.evaluate(AXE)
    found = await page.evaluate("axe.run({ resultTypes: ['violations'] })")
    assert [v["id"] for v in found["violations"] if v["impact"] in ("serious", "critical")] == []
    assert page.errors == []


async def test_help_and_menu_need_no_internet(studio: Open) -> None:
    page = await loaded(await studio(), APART)
    block = page.locator("[data-id=first] > .blocklyPath").first
    await block.click(button="right", position={"x": 8, "y": 8})
    await page.evaluate(AXE)
    found = await page.evaluate("axe.run({ resultTypes: ['violations'] })")
    assert [v["id"] for v in found["violations"] if v["impact"] in ("serious", "critical")] == []
    await page.locator(".blocklyMenuItem", has_text="Help").click()
    await page.wait_for_selector("dialog >> text=print('first')")
    assert len(page.context.pages) == 1
    assert page.errors == []


async def test_schedule_is_put_into_plain_words(studio: Open) -> None:
    page = await loaded(await studio(), APART)
    written = {
        "cycle": ["*/5 * * * *", "*/1 * * * *", "*/90 * * * *", "0 8 * * 1-5", "0 25 * * *", "15 * * * 1", "7 * * * *"],
        "single": ["8:05", "99:99", "tomorrow", "now + 1 hours", ""],
    }
    said = "wish => import('/studio/dialogs.js').then(({ plainly }) => wish[1].map((text) => plainly(wish[0], text)))"
    assert await page.evaluate(said, ["cycle", written["cycle"]]) == [
        "every 5 minutes",
        "every 1 minute",
        "as written: */90 * * * *",
        "Monday-Friday at 08:00",
        "as written: 0 25 * * *",
        "as written: 15 * * * 1",
        "every hour, at minute 7",
    ]
    assert await page.evaluate(said, ["single", written["single"]]) == [
        "at 8:05",
        "as written: 99:99",
        "as written: tomorrow",
        "in 1 hour",
        "",
    ]
    await page.click("button[aria-label='When it runs']")
    await page.fill("dialog .field input", "99:99")
    await page.click("dialog .button.main")
    await page.wait_for_selector("dialog .notice.bad:has-text('Refused')")
    assert await page.inner_text(".phase") == "Ready"  # nothing ran, so nothing ended with an error
