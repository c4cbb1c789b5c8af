"""Claims: the console is usable within 1 s, shows poses at most 150 ms old (p95), and a press is a command in 30 ms.

Robot and page run in a program each on this machine. A page is usable when the robot's state stands there. The robot
turns on the spot; a pose's age is from the instant at which the robot believed in it until the browser has painted it.
A press is on the pad for driving by hand, and a command is the action that the robot accepts. The page's size is what a
browser fetches for the live view, compressed as the server sends it, without the heads of answers.

    scripts/bench console_page
"""

from __future__ import annotations

import asyncio
import math
import statistics
import tempfile
import time
from dataclasses import replace
from typing import Any

from _claim import Claims
from playwright.async_api import Page, async_playwright

from roboglot.config import ConsoleConfig, RobotConfig, load_config, with_addresses
from roboglot.model.action import ActionStatus
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.events.moving import ActionChanged
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.runtime import Runtime

CHROMIUM = "/usr/bin/chromium"
OPENINGS, PRESSES = 9, 40
LOOK = 20.0  # s per place
TURNING = 0.5  # rad/s
PAINTED = """async () => {
    const { poses } = await import('/link.js');
    window.painted = [];
    poses.subscribe((now) => requestAnimationFrame(() => {
        const channel = new MessageChannel(); // its message comes after the frame is painted
        channel.port1.onmessage = () => window.painted.push([Date.now(), now.a?.[2]]);
        channel.port2.postMessage(0);
    }));
}"""
PRESSED = """() => {
    window.pressed = [];
    document.querySelector('.pad').addEventListener('pointerdown', () => window.pressed.push(Date.now()), true);
}"""


def length(headers: dict[str, str]) -> float:
    """Return the bytes of a file as it is sent."""
    return float({name.lower(): value for name, value in headers.items()}.get("content-length", 0))


async def opened(browser: Any, url: str) -> tuple[float, int]:
    """ms until a page that was never open is usable, and the bytes that came for it."""
    context = await browser.new_context()
    page = await context.new_page()
    inspector = await context.new_cdp_session(page)
    await inspector.send("Network.enable")
    sizes: list[float] = []
    inspector.on("Network.responseReceived", lambda event: sizes.append(length(event["response"]["headers"])))
    began = time.perf_counter()
    await page.goto(url, wait_until="commit")
    await page.wait_for_selector("text=Scan fits map")
    spent = 1000 * (time.perf_counter() - began)
    await asyncio.sleep(1.0)
    await context.close()
    return spent, round(sum(sizes))


async def ages(page: Page, robot: Robot) -> list[float]:
    """ms between a heading's belief and its painting, sorted."""
    await page.evaluate(PAINTED)
    believed: list[tuple[float, float]] = []  # ms, heading
    end = time.time() + LOOK
    while time.time() < end:
        robot[Driving].drive(Twist(0.0, 0.0, TURNING))
        believed.append((1000 * time.time(), robot[Localization].pose.yaw))
        await asyncio.sleep(0.005)
    robot[Driving].drive(Twist(0.0, 0.0, 0.0))
    found = []
    for painted, shown in (await page.evaluate("window.painted"))[20:]:
        recent = ((abs(math.remainder(shown - yaw, math.tau)), ms) for ms, yaw in believed if 0 <= painted - ms < 3000)
        found.append(painted - min(recent)[1])
    return sorted(found)


async def presses(page: Page, robot: Robot) -> list[float]:
    """ms between a press on the pad and the action that the robot accepts, sorted."""
    accepted: list[float] = []

    def note(change: ActionChanged) -> None:
        if change.action.name == "drive" and change.action.status is ActionStatus.ACCEPTED:
            accepted.append(1000 * time.time())

    leave = robot.events.listen(ActionChanged, note)
    await page.click("#tab-drive")
    pad = page.locator(".pad")
    await pad.scroll_into_view_if_needed()
    box = await pad.bounding_box()
    assert box is not None
    await page.evaluate(PRESSED)
    for _ in range(PRESSES):
        await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
        await page.mouse.down()
        await asyncio.sleep(0.25)
        await page.mouse.up()
        await asyncio.sleep(0.5)
    leave()
    spent = []
    for pressed in await page.evaluate("window.pressed"):
        later = [moment - pressed for moment in accepted if moment >= pressed - 1.0]
        spent.append(min(later, default=math.inf))
    return sorted(spent)


async def main() -> None:
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        base = load_config(None, {"data": folder, "world": "office"})
        robots = with_addresses((RobotConfig("a", "universal"),))
        runtime = Runtime(replace(base, robots=robots, console=ConsoleConfig(port=0)))
        await runtime.start()
        assert runtime.console is not None
        await runtime.console.ready()
        await asyncio.sleep(5.0)  # kernels
        robot = runtime.fleet.robots["a"]
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            looks = [await opened(browser, runtime.console.address) for _ in range(OPENINGS)]
            page = await browser.new_page()
            await page.goto(runtime.console.address)
            await page.wait_for_selector("text=Scan fits map")
            old = await ages(page, robot)
            pressed = await presses(page, robot)
            await browser.close()
        await runtime.close()
    times, sizes = zip(*looks, strict=True)
    print(f"opened {OPENINGS} times, ms: {', '.join(f'{spent:.0f}' for spent in times)}")
    print(f"{len(old)} poses, {len(old) / LOOK:.1f} a second: median {statistics.median(old):.0f} ms old")
    print(f"{len(pressed)} presses: median {statistics.median(pressed):.1f} ms")
    claims.at_most("usable, median", statistics.median(times), 1000.0, "ms")
    claims.at_most("page, compressed", statistics.median(sizes) / 1000, 60.0, "KB")
    claims.at_most("pose on the screen, p95", old[int(0.95 * len(old))], 150.0, "ms")
    claims.at_most("press to command, p95", pressed[int(0.95 * len(pressed))], 30.0, "ms")
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
