"""Announcements of the studio to a screen reader, and its view on a phone."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.served import shows, until
from tests.browser.test_studio import COUNTING, Open, loaded, phase, studio
from tests.browser.test_studio_class import WRONG

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")
LISTEN = """() => {
  const live = "[aria-live], [role=status], [role=alert]";
  window.heard = [];
  new MutationObserver((changes) => {
    for (const { target, addedNodes } of changes) {
      const at = target.nodeType === 1 ? target : target.parentElement;
      for (const region of [at?.closest(live), ...[...addedNodes].filter((n) => n.nodeType === 1 && n.matches(live))])
        if (region && !region.closest("[inert]")) window.heard.push(region.textContent.trim());
    }
  }).observe(document.body, { subtree: true, childList: true, characterData: true });
}"""
CUT = """() => Object.fromEntries(
  ["header .name input", ".looks select", "#tab-python", "#tab-group", ".stop", ".phase"]
  .map((each) => [each, document.querySelector(each).getBoundingClientRect()])
  .map(([each, box]) => [each, [Math.round(box.left), Math.round(box.right)]])
  .filter(([, [left, right]]) => !(0 <= left && left < right && right <= innerWidth)))"""

ROOM = """(() => {
  const looks = document.querySelector(".looks select"), pen = document.createElement("canvas").getContext("2d");
  pen.font = getComputedStyle(looks).font;
  return looks.clientWidth - 40 - Math.max(...[...looks.options].map(({ text }) => pen.measureText(text).width));
})()"""  # px beside the longest name


async def announced(page: Any, words: str) -> None:
    """Wait until a live region said this; what was said before is forgotten."""
    await until(page, f"window.heard.some((text) => text.includes({words!r}))")
    await page.evaluate("window.heard.length = 0")


async def test_runs_and_halts_are_announced(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    await page.evaluate(LISTEN)
    await page.evaluate("studio.editor.toggleBreak('say')")
    await page.keyboard.press("F5")
    await announced(page, "Paused · print n")  # the block's position in words
    await page.keyboard.press("F8")
    await until(page, "studio.runner.phase.value === 'paused' && studio.runner.lit.value !== 'say'")
    words = await page.evaluate("studio.editor.workspace.getBlockById(studio.runner.lit.value).toString(60)")
    await announced(page, f"Paused · {words}")
    await page.click("#tab-output")
    await page.keyboard.press("F5")
    await announced(page, "Paused · print n")  # on the next round
    await page.keyboard.press("F5")
    await announced(page, "9")  # the printed line
    await page.keyboard.press("Shift+F5")
    await announced(page, "Ended")
    await page.click("#tab-python")
    await loaded(page, WRONG)
    await page.keyboard.press("F5")
    await announced(page, "The list is not that long")  # although the output panel is hidden
    assert page.errors == []


async def test_messages_of_a_window_are_announced_in_it(studio: Open) -> None:
    page = await loaded(await studio(language="zh"), COUNTING)
    await page.click("button[aria-label=何时运行]")
    await until(page, "document.querySelector('dialog[open]')")
    await page.evaluate(LISTEN)
    await page.fill("dialog input", "no time at all")
    await page.click("dialog .main")
    await announced(page, "被拒绝")
    await page.wait_for_selector("dialog .notice")
    assert page.errors == []


@pytest.mark.parametrize(
    ("language", "width"), [("zh", 360), *(pytest.param("en", width, marks=pytest.mark.slow) for width in (360, 820))]
)
async def test_small_screens_show_names_and_panels_whole(studio: Open, language: str, width: int) -> None:
    page = await studio(language=language)
    await page.set_viewport_size({"width": width, "height": 740})
    await page.fill("header .name input", "Walk round and bark")
    for verb in ("运行", "暂停", "程序") if language == "zh" else ("Run", "Pause", "Programs"):  # seen as icons
        assert await page.get_by_role("button", name=verb, exact=True).first.get_attribute("title")
    await page.click(".switch button:nth-child(2)")
    await shows(page, CUT, {})
    assert await page.evaluate(ROOM) >= 0
    await until(page, "(i => i.scrollWidth <= i.clientWidth)(document.querySelector('header .name input'))")
    await until(page, f"document.documentElement.scrollWidth <= {width}")


async def test_help_is_a_window_in_the_own_language(studio: Open) -> None:
    page = await studio(language="zh")
    block = {"type": "cyberdog.motion.turn", "id": "turn", "x": 40, "y": 40}
    await loaded(page, {"blocks": {"languageVersion": 0, "blocks": [block]}})
    await page.evaluate("studio.editor.workspace.getBlockById('turn').showHelp()")
    for words in ("cyberdog.motion.turn(angle, duration)", "-360 … 359.9 °", "秒内转"):
        await until(page, f"document.querySelector('dialog[open]')?.innerText.includes({words!r})")
    await page.keyboard.press("Escape")
    await until(page, "!document.querySelector('dialog')")
    await phase(page, "idle")
