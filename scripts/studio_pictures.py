"""Draws the studio at three widths and in both languages, for people to look at before a release.

.venv/bin/python scripts/studio_pictures.py [folder]: without a folder only the pictures of docs/programs/studio.md are
drawn. Needs playwright, Debian's chromium and a Chinese font (fonts-wqy-microhei).
"""

from __future__ import annotations

import asyncio
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.async_api import async_playwright

from roboglot.config import load_config
from roboglot.runtime import Runtime

PICTURES = Path(__file__).parent.parent / "docs/images"
COLOURS = 64
SIZES = ((1600, 900), (820, 1180), (360, 740))
LOOKS = (("en", "light"), ("zh", "dark"))
TABS = ("python", "output", "values", "robot", "missions")
PROGRAM = (Path(__file__).parent / "studio/picture.js").read_text("utf-8").partition("\n")[2]


async def until(page: Any, expression: str) -> None:
    """Wait until an expression holds; Playwright's own way needs eval, which the page's policy forbids."""
    for _ in range(1200):
        if await page.evaluate(f"Boolean({expression})"):
            return
        await asyncio.sleep(0.05)
    raise TimeoutError(expression)


async def paused(browser: Any, url: str, size: tuple[int, int], look: tuple[str, str]) -> Any:
    """Return a page of one size in one look, whose program is held at a breakpoint."""
    (width, height), (language, theme) = size, look
    context = await browser.new_context(viewport={"width": width, "height": height}, has_touch=width < 900)
    choices = {"language": language, "theme": theme}
    await context.add_init_script(f"Object.assign(localStorage, {json.dumps(choices)})")
    page = await context.new_page()
    await page.goto(f"{url}/studio/")
    await until(page, "window.studio && studio.editor.workspace")
    await page.evaluate(PROGRAM)
    await asyncio.sleep(0.5)
    await page.evaluate("studio.runner.run()")
    await until(page, "studio.runner.phase.value === 'paused'")
    await asyncio.sleep(0.5)
    return page


async def end(page: Any) -> None:
    """End the program and close the page."""
    await page.evaluate("studio.runner.stop()")
    await until(page, "studio.runner.phase.value === 'idle'")
    await page.context.close()


async def shoot(browser: Any, url: str, folder: Path, size: tuple[int, int], look: tuple[str, str]) -> None:
    """Draw every panel of one size in one look."""
    page, (width, _), (language, _) = await paused(browser, url, size, look), size, look
    for tab in TABS:
        if width < 900:
            if tab == TABS[0]:
                await page.screenshot(path=folder / f"blocks-{width}-{language}.png")
            await page.click(".switch button:nth-child(2)")
        await page.click(f"#tab-{tab}")
        await asyncio.sleep(0.8)
        await page.screenshot(path=folder / f"{tab}-{width}-{language}.png")
    await end(page)


async def draw(browser: Any, url: str, name: str, language: str) -> None:
    """Draw a picture for docs/programs/studio.md."""
    page, path = await paused(browser, url, (1280, 720), (language, "light")), PICTURES / name
    await page.click("#tab-python")
    await asyncio.sleep(0.8)
    await page.screenshot(path=path)
    await end(page)
    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)


async def main(folder: Path | None) -> None:
    """Start a dog and look."""
    with tempfile.TemporaryDirectory() as data:
        config = load_config(
            None, {"data": data, "world": "playground", "robots": [{"name": "a", "body": "cyberdog2"}]}
        )
        runtime = Runtime(config)
        await runtime.start()
        assert runtime.console is not None
        await runtime.console.ready()
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
            )
            url = runtime.console.address
            if folder:
                for size in SIZES:
                    for look in LOOKS:
                        await shoot(browser, url, folder, size, look)
            else:
                await draw(browser, url, "studio.png", "en")
                await draw(browser, url, "studio.zh.png", "zh")
            await browser.close()
        await runtime.close()


if __name__ == "__main__":
    chosen = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    if chosen:
        chosen.mkdir(parents=True, exist_ok=True)
    asyncio.run(main(chosen))
