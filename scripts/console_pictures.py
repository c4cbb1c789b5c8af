"""Draws the console's views at three widths and in both languages, for people to look at before a release.

.venv/bin/python scripts/console_pictures.py [folder]: without a folder only docs/images/console.png is drawn.
Needs playwright, Debian's chromium and a Chinese font (fonts-wqy-microhei).
"""

from __future__ import annotations

import asyncio
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from PIL import Image
from playwright.async_api import async_playwright

from roboglot.config import load_config
from roboglot.runtime import Runtime

PICTURE = Path(__file__).parent.parent / "docs/images/console.png"
SIZES = ((1600, 900), (820, 1180), (360, 740))
LOOKS = (("en", "dark"), ("zh", "light"))
VIEWS = {
    "live": ("state", "drive", "actions", "plots"),
    "wire": (),
    "world": ("people", "faults", "drawn", "clock"),
    "robots": (),
    "class": (),
}
COLOURS = 256  # of the PNG in the docs


def post(url: str, values: object) -> None:
    """Have something done; what is refused is printed."""
    try:
        urlopen(Request(url, data=json.dumps(values).encode())).close()
    except HTTPError as error:
        print(url, error.read().decode())


def talk(rest: str) -> None:
    """Some exchanges for the wire view, one of them refused."""
    for path in ("slam/v1/localization/pose", "system/v1/power/status", "nothing"):
        try:
            urlopen(f"{rest}/api/core/{path}").close()
        except HTTPError:
            continue


async def shoot(browser: Any, url: str, folder: Path, size: tuple[int, int], look: tuple[str, str]) -> None:
    """Every view of one size in one look."""
    (width, height), (language, theme) = size, look
    context = await browser.new_context(viewport={"width": width, "height": height}, has_touch=width < 900)
    choices = {"language": language, "theme": theme, "person": "anna"}
    await context.add_init_script(f"Object.assign(localStorage, {json.dumps(choices)})")
    page = await context.new_page()
    for view, tabs in VIEWS.items():
        await page.goto(f"{url}/#/{view}")
        await page.wait_for_selector("main > :not(.empty)")
        await asyncio.sleep(1.0)
        if view == "wire":
            await asyncio.to_thread(talk, "http://127.0.0.1:1448")
            await asyncio.sleep(0.6)
        for tab in tabs or ("",):
            if tab:
                await page.click(f"#tab-{tab}")
                await asyncio.sleep(0.3)
            if tab == "drive" and await page.locator(".screen").count() == 0:
                await page.locator("figure button").first.click()
                await asyncio.sleep(4.0)
                await page.locator(".film").scroll_into_view_if_needed()
            await page.screenshot(path=folder / f"{view}-{tab or 'all'}-{width}-{language}.png")
    await context.close()


async def main(folder: Path | None) -> None:
    """Start two robots in the office, let one drive, and look."""
    with tempfile.TemporaryDirectory() as data:
        config = load_config(None, {"data": data, "robots": [{"name": "a"}, {"name": "b"}]})
        runtime = Runtime(config)
        await runtime.start()
        assert runtime.console is not None
        await runtime.console.ready()
        await asyncio.sleep(20.0)  # until navigation is ready
        url = runtime.console.address
        for verb, values, seconds in (
            ("go_to", {"points": [[5, 1]]}, 12.0),
            ("add_place", {"name": "Kitchen", "x": 5, "y": -1}, 0.0),
            ("add_line", {"kind": "wall", "start": [3, -2], "end": [3, -4]}, 0.0),
            ("go_to", {"points": [[1.5, 6], [1.5, -6], [5, 1]]}, 9.0),
        ):
            await asyncio.to_thread(post, f"{url}/api/robots/a/{verb}", values)
            await asyncio.sleep(seconds)
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
            )
            await picture(browser, url)
            for size in SIZES if folder else ():
                for look in LOOKS:
                    await shoot(browser, url, folder or PICTURE.parent, size, look)
            await browser.close()
        await runtime.close()


async def picture(browser: Any, url: str) -> None:
    """The one in the README: the live view with the truth beside it."""
    context = await browser.new_context(viewport={"width": 1280, "height": 760})
    await context.add_init_script('Object.assign(localStorage, {language: "en", theme: "dark", person: "anna"})')
    page = await context.new_page()
    await page.goto(f"{url}/#/live")
    await page.wait_for_selector("text=Scan fits map")
    await page.click("#tab-actions")
    await page.click('[aria-label="Show everything"]')
    await asyncio.sleep(1.0)
    await page.screenshot(path=PICTURE)
    await context.close()
    Image.open(PICTURE).convert("RGB").quantize(COLOURS).save(PICTURE, optimize=True)


if __name__ == "__main__":
    chosen = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    if chosen:
        chosen.mkdir(parents=True, exist_ok=True)
    asyncio.run(main(chosen))
