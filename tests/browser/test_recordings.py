"""Recordings and stored maps on pages: made, found again, fetched, replaced and deleted."""

from __future__ import annotations

import asyncio
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from roboglot.config import ConsoleConfig, RobotConfig, load_config
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import Point, Pose
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Files, Limits, Origin
from roboglot.recording.reader import read_recording
from roboglot.recording.redaction import Redaction
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.browser.served import OpenConsole, Served, Tabs, becomes
from tests.narrowing import known

pytestmark = pytest.mark.asyncio(loop_scope="session")


@pytest.mark.slow  # a view of its own; tests/recording has the recorder
async def test_a_recording_is_begun_marked_and_ended(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    page.on("dialog", lambda dialog: asyncio.ensure_future(dialog.accept("it bumped")))
    await page.click("#tab-actions")
    await page.click("button:has-text('Record')")
    await page.wait_for_selector("header >> text=REC")
    async with page.expect_response("**/api/recording"):
        await page.click("button:has-text('Mark')")
    await page.click("main a:has-text('Recordings')")
    await page.wait_for_selector("main li >> text=being recorded")
    assert "MB" not in await page.inner_text("main li")  # the card above says what is written
    await served.clock.advance(1.0)
    await page.click("text=End the recording")
    await page.wait_for_selector("text=is under")
    (file,) = (served.runtime.config.data / "recordings").glob("*.mcap")
    assert read_recording(file).topics["/marks"] == 1

    row = page.locator(f"li:has-text('{file.name}')")
    await row.locator("text=1.0 s · ").wait_for()
    async with page.expect_download() as loading:
        await row.locator("text=Download").click()
    loaded = await (await loading.value).path()
    assert await asyncio.to_thread(loaded.read_bytes) == await asyncio.to_thread(file.read_bytes)
    await row.locator("text=As a robot").click()
    await row.locator(f"text=recording:{file}").wait_for()
    await row.locator("text=Remove").click()  # the question is answered above
    await page.wait_for_selector("text=Nothing has been recorded yet.")
    assert not file.exists()


async def test_a_recording_is_watched_where_it_was_made(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(view="recordings")
    robot = served.robot

    async def shows(place: Pose) -> bool:
        """Tell whether the page shows the robot within 5 cm of a place."""
        found = re.search(r"x (\S+) · y (\S+) m", await page.inner_text("aside"))
        return found is not None and math.hypot(float(found[1]) - place.x, float(found[2]) - place.y) < 0.05

    await page.click("button:has-text('Record')")
    await page.wait_for_selector("text=End the recording")
    start = robot[Localization].pose
    await served.clock.advance(2.0)
    page.on("dialog", lambda dialog: asyncio.ensure_future(dialog.accept("it sets off")))
    async with page.expect_response("**/api/recording"):
        await page.click("button:has-text('Mark')")
    driving = robot[Navigation].navigate_to([Point(1.5, 0.0)], NavigationOptions())
    while not driving.status.ended:
        await served.clock.advance(0.5)
    end = robot[Localization].pose
    await served.clock.advance(1.0)
    await page.click("text=End the recording")

    await page.click("main li button:has-text('Watch')")
    await page.wait_for_selector("text=This moves no robot.")
    await page.click("[aria-label=Pause]")  # first: it would play on from the mark
    await page.click("[aria-label='0:02: it sets off']")
    await becomes(lambda: shows(start), True)
    assert "done" not in await page.inner_text("aside")
    seconds = await page.locator(".player input").get_attribute("max")
    await page.fill(".player input", seconds or "")
    await becomes(lambda: shows(end), True)
    await page.wait_for_selector("aside li:has-text('navigate to') >> text=done")
    await page.click("text=All recordings")
    await page.click("main li button:has-text('Remove')")
    await page.wait_for_selector("text=Nothing has been recorded yet.")


async def test_page_says_what_a_recorded_robot_is(browser: Any, tmp_path: Path) -> None:
    """It said that all was well beside an empty map."""
    file = tmp_path / "talk.mcap"
    files = Files(file, Origin({"version": "1", "robots": '{"a": "universal"}'}), Redaction(), Limits())
    files.open(NANO)
    asked = Exchange(0.0, "a", "slamware", "c", "127.0.0.1", Direction.REQUEST, "GET /", b"")
    files.write(Entry("/a/slamware", "exchange", NANO, 0, asked))
    files.close()
    base = load_config(None, {"data": str(tmp_path / "data"), "world": "empty"})
    robots = (RobotConfig("a", f"recording:{file}", free_addresses(1)),)
    runtime = Runtime(replace(base, robots=robots, console=ConsoleConfig(port=0)))
    await runtime.start()
    await known(runtime.console).ready()
    tabs = Tabs(browser, known(runtime.console).address)
    try:
        page = await tabs.open("/#/live", {"person": "anna", "language": "en"}, {"width": 1280, "height": 800})
        await page.wait_for_selector("text=This robot answers apps as it did in talk.mcap.")
        assert "All is well." not in await page.inner_text("main")
    finally:
        await tabs.close()
        await runtime.close()


async def test_stored_map_is_replaced_only_when_confirmed(served: Served, open_console: OpenConsole) -> None:
    name, sure = "Name of the map", "Replace the stored map hall?"
    page, library, asked = await open_console(view="world"), served.robot[MapLibrary], list[str]()
    confirmed = True

    async def answer(dialog: Any) -> None:
        asked.append(dialog.message)
        await (dialog.accept("hall ") if confirmed or dialog.message == name else dialog.dismiss())

    async def save(*questions: str) -> None:
        asked.clear()
        await page.click("button:has-text('Save the map')")
        await becomes(lambda: asyncio.sleep(0, [*asked]), [*questions])

    async def saved_at() -> float | None:
        return (await library.get("hall")).saved_at if "hall" in await library.names() else None

    page.on("dialog", lambda dialog: asyncio.ensure_future(answer(dialog)))
    await served.clock.advance(2.0)  # makes a map
    await page.click("#tab-drawn")
    await save(name)
    await becomes(saved_at, served.clock.epoch())
    first = served.clock.epoch()
    await served.clock.advance(1.0)
    confirmed = False
    await save(name, sure)
    assert await saved_at() == first
    confirmed = True
    await save(name, sure)
    await becomes(saved_at, served.clock.epoch())
    grids, loads = (
        list[MapReplaced](),
        "Load the map hall? It replaces the map in use, which is lost unless it is saved.",
    )
    served.robot.events.listen(MapReplaced, grids.append)
    for now in (False, True):
        confirmed = now
        asked.clear()
        await page.click("button:has-text('Load')")
        await becomes(lambda: asyncio.sleep(0, [*asked]), [loads])
    await becomes(lambda: asyncio.sleep(0, len(grids)), 1)  # of the load that was confirmed
    await library.remove("hall")
