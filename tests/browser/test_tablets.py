"""Habits of iPads, iPhones and Macs, as far as Chromium can be made to have them."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from tests.browser.served import OpenConsole, Served, becomes, is_driven, shows, until

pytestmark = pytest.mark.asyncio(loop_scope="session")
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
SMALL_PRINT = """() => [...document.querySelectorAll('input:not([type=range]), select')]
    .filter(e => parseFloat(getComputedStyle(e).fontSize) < 16).map(e => e.outerHTML.slice(0, 80))"""
LEFT = "element => Math.round(element.getBoundingClientRect().left)"
INSETS = {"top": 20, "left": 47, "right": 47, "bottom": 21}  # of an iPhone on its side
# How long what is saved can be read: Safari reads it once the person has said yes.
KEPT_FOR = """() => import('/copies.js').then(copies => {
    const { setTimeout } = window, asked = [];
    window.setTimeout = (_, ms) => asked.push(ms);
    try { copies.saveAs(new Blob(['x']), 'x.txt'); } finally { window.setTimeout = setTimeout; }
    return Math.min(...asked);
})"""
NO_CLIPBOARD = "Object.defineProperty(navigator, 'clipboard', { value: undefined })"
PASTED = "Object.getOwnPropertyDescriptor(Navigator.prototype, 'clipboard').get.call(navigator).readText()"


async def test_phones_zoom_in_on_no_field(served: Served, open_console: OpenConsole) -> None:
    """Safari zooms in on a field whose letters are smaller than 16 px, and on two quick taps."""
    page = await open_console(**PHONE)
    for view in ("live", "wire", "world"):
        await page.evaluate(f"location.hash = '#/{view}'")
        await page.wait_for_selector(f"nav a[href='#/{view}'][aria-current=page]")
        assert await page.evaluate(SMALL_PRINT) == [], view
    assert await page.evaluate("getComputedStyle(document.documentElement).touchAction") == "manipulation"


async def test_nothing_lies_under_a_phones_notch(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(**{**PHONE, "viewport": {"width": 844, "height": 390}})
    devtools = await page.context.new_cdp_session(page)
    await devtools.send("Emulation.setSafeAreaInsetsOverride", {"insets": INSETS})
    await becomes(lambda: page.eval_on_selector("nav", LEFT), INSETS["left"])
    assert await page.eval_on_selector("header", LEFT) == INSETS["left"]
    for selector in (".stop", "aside"):
        box = await page.locator(selector).bounding_box()
        assert box["x"] + box["width"] <= 844 - INSETS["right"]
        assert box["y"] >= INSETS["top"]
        assert box["y"] + box["height"] <= 390 - INSETS["bottom"]


async def test_a_macs_command_key_lets_go(served: Served, open_console: OpenConsole) -> None:
    """While it is held, a Mac never says that another key was released: the robot would drive on."""
    page = await open_console()
    await page.click("#tab-drive")
    await page.wait_for_selector(".pad")
    await page.keyboard.down("w")
    await becomes(lambda: asyncio.sleep(0, is_driven(served.robot)), True)
    await page.keyboard.down("Meta")
    await page.wait_for_selector(".pad:not(.held)")
    await becomes(lambda: asyncio.sleep(0, is_driven(served.robot)), False)
    await page.keyboard.up("w")
    await page.keyboard.up("Meta")


async def test_files_stay_readable_until_safari_asked(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    assert await page.evaluate(KEPT_FOR) >= 30_000


async def test_browser_that_cannot_film_says_so(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.evaluate("delete window.MediaRecorder")
    await page.click("#tab-drive")
    await page.click("text=Show the camera")
    await page.click("figure >> text=Film")
    await page.wait_for_selector(".notice >> text=this browser cannot film.")


async def test_text_is_copied_whole_without_https(served: Served, open_console: OpenConsole, tmp_path: Path) -> None:
    """The pages of a class have no https and so no clipboard; a question's only line would lose the line breaks."""
    page = await open_console(view="wire", permissions=["clipboard-read"])
    await page.evaluate(NO_CLIPBOARD)
    await until(page, "document.querySelector('.filters')")
    await becomes(lambda: asyncio.sleep(0, served.robot.tap.watched), True)
    served.robot.tap.request("robomaster", "chassis move", b"chassis move x 0.1;")
    await page.locator(".lines li.request .line", has_text="chassis move").first.click()
    await page.click("text=Copy as python")
    await page.wait_for_selector(".notice >> text=Copied as python.")
    await shows(page, f"{PASTED}.then(text => text.split('\\n').length > 3)", True)
