"""The studio in Chromium: first block in hand, run to first light, stop, loading and dragging many blocks, 25 pages.

    scripts/bench studio

Each figure is the time on the wall of a machine that may be busy, and after it what the page's own thread worked for
it, which other work on the machine hardly changes. Peer of the same run: Blockly alone, loading the same blocks in the
same browser, which separates the studio's share from the library's. Needs playwright and Debian's chromium.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import uvloop
from playwright.async_api import async_playwright

from roboglot.config import load_config
from roboglot.programs.tasks.reports import TaskReport
from roboglot.runtime import Runtime

PAGES = 25
CROWD_SECONDS = 6.0
READY = "window.studio && studio.editor.workspace && document.querySelector('.button.main:enabled')"
PAGE = Path(__file__).with_name("studio_page.js").read_text("utf-8")


async def until(page: Any, expression: str) -> None:
    """Wait until an expression holds; Playwright's own way needs eval, which the page's policy forbids."""
    for _ in range(1200):
        if await page.evaluate(f"Boolean({expression})"):
            return
        await asyncio.sleep(0.05)
    raise TimeoutError(expression)


class Work:
    """Work of one page's thread."""

    def __init__(self, page: Any) -> None:
        self._page = page
        self._session: Any = None

    async def so_far(self) -> float:
        """Milliseconds since it was first asked for."""
        if self._session is None:
            self._session = await self._page.context.new_cdp_session(self._page)
            await self._session.send("Performance.enable", {"timeDomain": "threadTicks"})
        found = await self._session.send("Performance.getMetrics")
        return float(next(row["value"] for row in found["metrics"] if row["name"] == "TaskDuration")) * 1e3


async def opened(browser: Any, url: str, work: list[float] | None = None) -> tuple[Any, float]:
    """Return a new page and the ms until a block can be taken; add those that its thread worked to ``work``."""
    page = await (await browser.new_context(viewport={"width": 1400, "height": 900})).new_page()
    meter = Work(page)
    before = await meter.so_far() if work is not None else 0.0
    began = time.perf_counter()
    await page.goto(f"{url}/studio/")
    await until(page, READY)
    took = (time.perf_counter() - began) * 1e3
    if work is not None:
        work.append(await meter.so_far() - before)
    await page.evaluate(PAGE)
    return page, took


async def lit(page: Any) -> float:
    """Milliseconds from run to the first lit block."""
    await page.evaluate("bench.loop()")
    await page.evaluate("studio.runner.run()")
    await until(page, "studio.runner.lights.count > 0")
    return float(await page.evaluate("studio.runner.lights.late"))


async def crowd(pages: list[Any], runtime: Runtime) -> list[float]:
    """Milliseconds from a block's begin on the robot until a page lights it, of 25 programs at once, in order."""
    begun: dict[tuple[str, str], list[float]] = {}
    robots = list(runtime._programs)

    def note(report: TaskReport) -> None:
        if report.block and report.block[0] == "begin":
            begun.setdefault((report.task, report.block[1]), []).append(time.time() * 1e3)

    for programs in runtime._programs.values():
        programs.service.reports.join(note)
    for number, page in enumerate(pages):
        await page.evaluate("name => bench.choose(name)", robots[number % len(robots)])
        await page.evaluate("bench.loop(); bench.watch()")
    await asyncio.gather(*(page.evaluate("studio.runner.run()") for page in pages))
    await asyncio.sleep(CROWD_SECONDS)
    found = []
    for page in pages:
        task, seen = await page.evaluate("[studio.program.value.id, bench.seen]")
        for block, at in seen:
            before = [began for began in begun.get((task, block), []) if began <= at]
            found += [at - before[-1]] if before else []
    return sorted(found)


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
            work: list[float] = []
            page, ready = await opened(browser, url, work)
            print(f"load of the machine {os.getloadavg()[0]:.1f}")
            print(f"first block in hand         {ready:7.0f} ms   (goal 1500); page's thread {work[0]:.0f}")
            meter = Work(page)
            await meter.so_far()
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
                before = await meter.so_far()
                ours = await page.evaluate(f"bench.load({count})")
                between = await meter.so_far()
                alone = await page.evaluate(f"bench.alone({count})")
                worked, peer = between - before, await meter.so_far() - between
                print(f"{count:4} blocks load            {ours:7.0f} ms   (goal {goal}); Blockly alone {alone:.0f}")
                print(
                    f"     the page's thread      {worked:7.0f} ms; Blockly alone {peer:.0f}: {worked / peer:.2f} of it"
                )
            print(f"drag at 200 blocks, p95     {await drag(page):7.0f} ms   (goal 33)")
            await page.context.close()
            pages = [(await opened(browser, url))[0] for _ in range(PAGES)]
            late = await crowd(pages, runtime)
            print(
                f"{PAGES} pages, {PAGES} programs: lit block {late[len(late) // 2]:.0f} ms behind (median), "
                f"{late[int(len(late) * 0.95)]:.0f} (95 %), {late[-1]:.0f} at most of {len(late)}   (goal 250)"
            )
            print(f"load of the machine {os.getloadavg()[0]:.1f}")
            await browser.close()
        await runtime.close()


if __name__ == "__main__":
    uvloop.run(main())
