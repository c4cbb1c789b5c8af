"""The studio in Chromium: first block in hand, run to first light, stop, loading and dragging many blocks, 25 pages.

    scripts/bench studio

Peer of the same run: Blockly alone, loading the same blocks in the same browser, so that what the studio adds is
told apart from the library and the machine. Needs playwright and Debian's chromium.
"""

from __future__ import annotations

import asyncio
import shutil
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from playwright.async_api import async_playwright

from roboglot.config import load_config
from roboglot.runtime import Runtime

PAGES = 25
READY = "window.studio && studio.editor.workspace && document.querySelector('.button.main:enabled')"
PAGE = Path(__file__).with_name("studio_page.js").read_text("utf-8")


async def until(page: Any, expression: str) -> None:
    """Wait until an expression holds; Playwright's own way needs eval, which the page's policy forbids."""
    for _ in range(1200):
        if await page.evaluate(f"Boolean({expression})"):
            return
        await asyncio.sleep(0.05)
    raise TimeoutError(expression)


async def opened(browser: Any, url: str) -> tuple[Any, float]:
    """A new page and the milliseconds until a block can be taken."""
    page = await (await browser.new_context(viewport={"width": 1400, "height": 900})).new_page()
    began = time.perf_counter()
    await page.goto(f"{url}/studio/")
    await until(page, READY)
    took = (time.perf_counter() - began) * 1e3
    await page.evaluate(PAGE)
    return page, took


async def lit(page: Any) -> float:
    """Milliseconds from run to the first lit block."""
    await page.evaluate("bench.loop()")
    await page.evaluate("studio.runner.run()")
    await until(page, "studio.runner.lights.count > 0")
    return float(await page.evaluate("studio.runner.lights.late"))


async def drag(page: Any) -> float:
    """Milliseconds of the 95th percentile of frames while a stack of blocks is dragged."""
    await page.evaluate("bench.load(200)")
    box = await page.evaluate("bench.corner()")
    await page.mouse.move(*box)
    await page.mouse.down()
    frames = asyncio.ensure_future(page.evaluate("bench.frames()"))
    for step in range(60):
        await page.mouse.move(box[0] + 4 * step, box[1] + 2 * (step % 20))
    found = sorted(await frames)
    await page.mouse.up()
    return float(found[int(len(found) * 0.95)])


async def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as data:
        robots = [{"name": f"r{i}", "body": "cyberdog2"} for i in range(4)]
        runtime = Runtime(load_config(None, {"data": data, "world": "empty", "robots": robots}))
        await runtime.start()
        assert runtime.console is not None
        await runtime.console.ready()
        url = runtime.console.address
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
            )
            page, ready = await opened(browser, url)
            print(f"first block in hand         {ready:7.0f} ms   (goal 1500)")
            lights, stops = [], []
            for _ in range(5):
                lights.append(await lit(page))
                stops.append(float(await page.evaluate("bench.stop()")))
                await asyncio.sleep(0.3)
            print(f"run to first lit block      {statistics.median(lights):7.0f} ms   (goal 150)")
            print(f"stop                        {statistics.median(stops):7.0f} ms   (goal 50)")
            await page.evaluate("bench.load(50)")  # both are warm from here on
            await page.evaluate("bench.alone(50)")
            for count, goal in ((200, 700), (1000, 3000)):
                ours = await page.evaluate(f"bench.load({count})")
                alone = await page.evaluate(f"bench.alone({count})")
                print(f"{count:4} blocks load            {ours:7.0f} ms   (goal {goal}); Blockly alone {alone:.0f}")
            print(f"drag at 200 blocks, p95     {await drag(page):7.0f} ms   (goal 33)")
            await page.context.close()
            pages = [(await opened(browser, url))[0] for _ in range(PAGES)]
            late = await asyncio.gather(*(lit(page) for page in pages[:4]))
            print(f"{PAGES} pages open, 4 robots run: first light {max(late):.0f} ms at most")
            await browser.close()
        await runtime.close()


if __name__ == "__main__":
    asyncio.run(main())
