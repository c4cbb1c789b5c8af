"""A class in real pages: join by code, the teacher's grid, a pupil's screen shown, handed in, stopped, exported.

And pages of those who may not move a robot now: it is locked by the teacher, or not theirs to stop.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from roboglot.access.store import Grant
from roboglot.model.components.system.lease import TEACHER, Lease
from roboglot.operations import Right
from tests.browser.served import shows, until
from tests.browser.test_rights import PASSWORD, Guarded, guarded, open_page, sign_in
from tests.browser.test_studio import FOREVER, Open, Page, loaded, phase, studio
from tests.narrowing import known

__all__ = ["guarded", "open_page", "studio"]  # the fixtures
pytestmark = pytest.mark.asyncio(loop_scope="session")
UNDER = """[...document.querySelectorAll('.pupils li > *')].filter(part => { // hidden by something, or out of its card
    const box = part.getBoundingClientRect(), card = part.parentElement.getBoundingClientRect();
    return box.right > card.right || part.contains(document.elementFromPoint(box.right - 6, box.top + 6)) === false;
}).map(part => part.outerHTML)"""
WRONG = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {
                "type": "text_print",
                "id": "bad",
                "x": 30,
                "y": 30,
                "inputs": {"TEXT": {"block": {"type": "lists_getIndex", "fields": {"MODE": "GET", "WHERE": "FIRST"}}}},
            }
        ],
    }
}

QUICK = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {"type": "forever", "id": "quick", "x": 30, "y": 30, "inputs": {"DO": {"block": {
                "type": "math_change", "id": "add", "fields": {"VAR": {"name": "n"}},
                "inputs": {"DELTA": {"shadow": {"type": "math_number", "fields": {"NUM": 1}}}},
                "next": {"block": {
                    "type": "math_change", "id": "more", "fields": {"VAR": {"name": "n"}},
                    "inputs": {"DELTA": {"shadow": {"type": "math_number", "fields": {"NUM": 2}}}},
                }}}}}}
        ],
    }
}  # fmt: skip
QUICK_WORDS = "change n by"


async def error_is_in_the_teachers_language(teacher: Page, pupil: Page) -> None:
    for language, other in (("en", "中文"), ("zh", "EN")):
        words = await pupil.evaluate(f"studio.runner.failure.value.{language}")
        await until(teacher, f"document.querySelector('.pupils li.bad')?.textContent.includes({words!r})")
        await teacher.click(f"header >> text={other}")


@pytest.mark.slow  # a long story; tests/console/test_studio_socket.py has the class
async def test_a_class_from_its_code_to_its_results(studio: Open) -> None:
    teacher, anna = await studio(), await studio()
    await teacher.click("#tab-group")
    await teacher.fill("form:nth-of-type(2) input[name=name]", "7b")
    await teacher.click("form:nth-of-type(2) button")
    await until(teacher, "document.querySelector('.code')")
    code = await teacher.inner_text(".code")

    await anna.click("#tab-group")
    await anna.fill("input[name=code]", code.lower())
    await anna.fill("form:nth-of-type(1) input[name=name]", "Anna")
    await anna.click("form:nth-of-type(1) button")
    await until(anna, f"document.querySelector('#panel').textContent.includes('{code}')")
    row = "document.querySelector('.pupils li')?.textContent"
    await until(teacher, f"{row}?.includes('Anna')")

    await loaded(anna, FOREVER)
    await anna.keyboard.press("F5")
    await phase(anna, "running")
    await until(anna, "studio.runner.lit.value === 'count'")
    words = await anna.evaluate("studio.editor.workspace.getBlockById('count').toString(60)")
    await until(teacher, f"{row}.includes({words!r})")  # the block lit on the pupil's page
    await teacher.click(".pupils button")  # the pupil's screen on the projector
    await until(teacher, "studio.editor.workspace.getAllBlocks(false).length === 3")
    await until(teacher, "studio.program.value.name.includes('Anna')")
    await teacher.click("#panel .button.danger")  # stop all
    await phase(anna, "idle")
    await teacher.wait_for_selector(".notice >> text=Stopped robots: 1.")

    await loaded(anna, QUICK)  # its blocks change faster than pupils report
    await anna.keyboard.press("F5")
    for words in ("Running", QUICK_WORDS):
        await until(teacher, f"{row}.includes({words!r})")
    await teacher.click("#panel .button.danger")
    await phase(anna, "idle")

    await loaded(anna, WRONG)
    await anna.keyboard.press("F5")
    await until(anna, "studio.runner.failure.value")
    await error_is_in_the_teachers_language(teacher, anna)
    await anna.click("#panel .button.main")
    await until(teacher, f"{row}.includes('handed in')")
    await teacher.set_viewport_size({"width": 1600, "height": 900})  # narrow cards, three in a row
    await shows(teacher, UNDER, [])
    async with teacher.expect_download() as saved:
        await teacher.click("text=Results as a table")
    text = await asyncio.to_thread(Path(await (await saved.value).path()).read_text, "utf-8-sig")
    assert text.splitlines()[0].startswith('"name","world","robot","stars"')
    assert text.splitlines()[1].startswith('"Anna","","a","0","yes"')
    await anna.reload()  # still in the class
    await until(anna, f"document.querySelector('#panel')?.textContent.includes('{code}')")
    await anna.context.close()
    await until(teacher, f"{row}.includes('away')")
    assert teacher.errors == []


async def test_buttons_of_locked_robots_say_why(guarded: Guarded, open_page: Open) -> None:
    guarded.add("lea", "program")
    page, lease, why = await open_page(), guarded.runtime.fleet.robots["a"][Lease], "The teacher has locked this robot."
    await sign_in(page, "lea")
    await page.wait_for_selector("text=Tap to send the robot")
    await lease.take(TEACHER)
    await page.wait_for_selector(f"button[aria-disabled=true][title='{why}']:has-text('Take control')")
    assert await page.locator("text=Tap to send the robot").count() == 0
    assert await page.get_attribute(".stop", "aria-disabled") is None
    await lease.release()
    await page.wait_for_selector("text=Tap to send the robot")


async def test_refused_stop_of_all_says_why(guarded: Guarded, open_page: Open) -> None:
    rights = [Grant("a", frozenset({Right.DRIVE})), Grant("b", frozenset({Right.SEE}))]
    guarded.store.add_person("half", PASSWORD, rights)
    known(guarded.runtime.guard).reload()
    page = await open_page()
    await sign_in(page, "half")
    await page.click("nav >> text=Robots")
    await page.click("text=Stop all")
    await page.wait_for_selector("text=/^Not stopped: b \\(.*drive.*\\)$/")
