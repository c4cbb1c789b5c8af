"""Claim: the heap of the console's live page is flat over an hour (± 10 %), after the plots' ten minutes are full.

The page gets an hour's messages in twelve minutes: poses, scans and states come five times as often, and robot time
passes five times as fast while the robot drives in a circle. The heap is what Chromium holds after a collection.

    scripts/bench console_heap [--minutes 12]
"""

from __future__ import annotations

import argparse
import asyncio
import statistics
import tempfile
from dataclasses import replace
from unittest.mock import patch

from _claim import Claims
from playwright.async_api import async_playwright

from roboglot.config import ConsoleConfig, RobotConfig, load_config, with_addresses
from roboglot.console.settings import BEAT
from roboglot.model.clock import RealClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Twist
from roboglot.runtime import Runtime

FASTER = 5  # times the usual message rate
SAMPLES = 24
CHROMIUM = "/usr/bin/chromium"


async def main(minutes: float) -> None:
    with tempfile.TemporaryDirectory() as folder, patch("roboglot.console.server.BEAT", BEAT / FASTER):
        base = load_config(None, {"data": folder, "world": "office"})
        robots = with_addresses((RobotConfig("a", "universal"),))
        runtime = Runtime(replace(base, robots=robots, console=ConsoleConfig(port=0)))
        assert isinstance(runtime.clock, RealClock)
        assert runtime.console is not None
        await runtime.start()
        await runtime.console.ready()
        await asyncio.sleep(5.0)  # kernels
        runtime.clock.set_speed(FASTER)
        runtime.fleet.robots["a"][Driving].drive(Twist(0.15, 0.0, 0.6))
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            page = await browser.new_page()
            await page.goto(runtime.console.address)
            await page.wait_for_selector("canvas")
            await page.click("#tab-plots")
            inspector = await page.context.new_cdp_session(page)
            heaps = []
            for number in range(SAMPLES):
                await asyncio.sleep(60.0 * minutes / SAMPLES)
                await inspector.send("HeapProfiler.collectGarbage")
                used = (await inspector.send("Runtime.getHeapUsage"))["usedSize"] / 1e6
                heaps.append(used)
                print(f"{FASTER * minutes * (number + 1) / SAMPLES:5.1f} min  {used:.2f} MB", flush=True)
            await browser.close()
        await runtime.close()
    claims = Claims()
    full = SAMPLES // 4  # plots are full after ten of sixty minutes
    early, late = statistics.median(heaps[full : full + 4]), statistics.median(heaps[-4:])
    claims.at_most("heap at the end, of that when the plots were full", late / early, 1.1, "")
    claims.finish()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--minutes", type=float, default=12.0)
    asyncio.run(main(parser.parse_args().minutes))
