"""The console in a real browser: what a person clicks is what the robot does, and who goes away lets go."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from roboglot.config import ConsoleConfig, RobotConfig, load_config
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system.lease import Lease
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from tests.browser.served import ADDRESS, OpenConsole, Page, Served, becomes, drive_until, is_driven, shows
from tests.browser.served import PAGE_PATIENCE as PATIENCE
from tests.browser.served import until as until_page

pytestmark = pytest.mark.asyncio(loop_scope="session")
# Its timers end, and the answer to this question says that all it sent before has come.
FREEZE = """for (let i = 0; i < 1e4; i++) clearInterval(i);
    import('/link.js').then((link) => link.ask('a', 'no such verb')).catch(() => undefined)"""
# The texts on each canvas since it was last cleared.
WRITTEN = """() => {
    window.written = [];
    const kind = CanvasRenderingContext2D.prototype, { clearRect, fillText } = kind;
    kind.clearRect = function (...all) { window.written.push(this.texts = []); clearRect.apply(this, all); };
    kind.fillText = function (text, ...all) { this.texts?.push(text); fillText.call(this, text, ...all); };
}"""
LABELS = "found => found.map((one) => one.getAttribute('aria-label') ?? one.innerText)"


async def until(condition: Callable[[], bool], patience: float = PATIENCE / 1000) -> None:
    """Wait, in the machine's time (s), for what a page sent."""
    async with asyncio.timeout(patience):
        while not condition():  # noqa: ASYNC110 - a page has no event of ours
            await asyncio.sleep(0.02)


def speed_of(served: Served) -> float:
    return served.robot[Base].velocity.speed


async def driven(served: Served, page: Page) -> None:
    """Hold the pad upwards until the robot moves; time passes while it is held."""
    pad = page.locator(".pad")
    await pad.scroll_into_view_if_needed()
    box = await pad.bounding_box()
    await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
    await page.mouse.down()
    await until(lambda: any(action.name == "drive" for action in served.robot.actions.running()))
    await drive_until(served.robot, served.clock, lambda: speed_of(served) > 0.1)


async def test_click_on_the_map_brings_the_robot_there(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    before = served.runtime.fleet.world.truth.pose_of("a")
    await page.wait_for_selector("text=Scan fits map")
    box = await page.locator("canvas").bounding_box()
    await page.mouse.click(box["x"] + box["width"] / 2 + 60, box["y"] + box["height"] / 2)
    await until(lambda: any(action.client == "console anna" for action in served.robot.actions.running()))
    (action,) = served.robot.actions.running()
    await served.clock.advance(20.0)
    assert action.status.name == "SUCCEEDED", action.reason
    assert served.runtime.fleet.world.truth.pose_of("a").distance_to(before) > 0.3
    await page.click("#tab-actions")
    await page.wait_for_selector(".badge.succeeded")


async def test_robot_stands_when_the_driving_page_is_killed(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-drive")
    await driven(served, page)
    await page.context.close()
    await until(lambda: not is_driven(served.robot))
    await served.clock.advance(0.5)
    assert speed_of(served) < 0.02


async def test_the_robot_stands_when_the_pad_falls_silent(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-drive")
    await driven(served, page)
    await page.evaluate(FREEZE)
    await served.clock.advance(0.7)  # 0.3 s of silence, then it brakes
    assert speed_of(served) < 0.02


async def test_escape_stops_and_letting_go_does(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-drive")
    await driven(served, page)
    await page.mouse.up()
    await until(lambda: not is_driven(served.robot))
    await served.clock.advance(0.5)
    assert speed_of(served) < 0.02
    await page.keyboard.down("w")
    await until(lambda: is_driven(served.robot))
    await page.keyboard.press("Escape")
    await page.wait_for_selector(".warned >> text=let go")  # what the held key goes on to ask for is refused
    await served.clock.advance(1.0)
    assert served.robot.actions.running() == []
    await page.keyboard.up("w")
    await page.wait_for_selector(".warned", state="detached")
    await page.keyboard.down("w")
    await until(lambda: is_driven(served.robot))
    await page.keyboard.up("w")


async def test_arrow_keys_drive_after_the_tab(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-drive")
    for patience in (5.0, 50.0):  # a key that was pressed before the pad was there is not seen
        await page.keyboard.up("ArrowUp")
        await page.keyboard.down("ArrowUp")
        with contextlib.suppress(TimeoutError):
            await until(lambda: is_driven(served.robot), patience)
            break
    assert is_driven(served.robot)
    await page.keyboard.up("ArrowUp")


@pytest.mark.slow  # in short: test_the_robot_stands_when_the_pad_falls_silent
async def test_a_gamepad_drives_and_stops(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.evaluate("""() => { window.stick = [0, 0, 0, 0];
        navigator.getGamepads = () => [null, { axes: window.stick }]; }""")
    await page.click("#tab-drive")
    await page.wait_for_selector(".pad")
    await page.evaluate("window.stick = [0, -1, 0, 0]")  # forward
    await until(lambda: any(action.name == "drive" for action in served.robot.actions.running()))
    await drive_until(served.robot, served.clock, lambda: served.robot[Base].velocity.x > 0.1)
    await page.evaluate("window.stick = [0.05, -0.05, 0, 0]")  # a stick never rests at zero
    await until(lambda: not is_driven(served.robot))
    await served.clock.advance(0.5)
    assert speed_of(served) < 0.02


def rest(served: Served, x: float) -> tuple[int, str]:
    """Ask by Slamware's REST to go there; the status and the answer."""
    goal = {"target": {"x": x, "y": 0, "z": 0}}
    wish = {"action_name": "slamtec.agent.actions.MoveToAction", "options": goal}
    address = f"http://{ADDRESS}:1448/api/core/motion/v1/actions"
    try:
        with urlopen(Request(address, json.dumps(wish).encode(), {"content-type": "application/json"})) as reply:
            return reply.status, reply.read().decode()
    except HTTPError as error:
        with error:
            return error.code, error.read().decode()


@pytest.mark.slow  # long; tests/console/test_live.py has two pages without a browser
async def test_two_browsers_and_rest_client_contend_for_control(served: Served, open_console: OpenConsole) -> None:
    anna, ben = await open_console("anna"), await open_console("ben")
    await anna.click("text=Take control")
    await anna.wait_for_selector("text=Only you may move this robot.")
    assert served.robot[Lease].taken_by == "console anna"
    await ben.wait_for_selector("text=Only console anna may move this robot.")
    await ben.wait_for_selector("text=Scan fits map")
    box = await ben.locator("canvas").bounding_box()
    await ben.mouse.click(box["x"] + box["width"] / 2 + 60, box["y"] + box["height"] / 2)
    await ben.wait_for_selector("text=Refused: control is taken by console anna")
    status, answer = await asyncio.to_thread(rest, served, 1.0)
    assert (status, "console anna" in answer) != (200, False)
    assert status >= 400, answer
    assert served.robot.actions.running() == []
    await ben.click("text=Take control")
    await anna.wait_for_selector("text=Only console ben may move this robot.")
    await anna.click("text=Release")
    await ben.wait_for_selector("text=Free: the newest command counts.")
    status, answer = await asyncio.to_thread(rest, served, 0.5)
    assert status == 200, answer
    await anna.wait_for_selector("text=/slamware .* moves it/")  # both pages name the driver
    await ben.wait_for_selector("text=/slamware .* moves it/")


@pytest.mark.slow  # a view of its own
async def test_plots_show_the_robots_speed_and_battery(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-plots")
    for plot in ("speed", "battery", "fit", "link"):
        await page.locator(f"[data-plot={plot}] canvas").wait_for()
        said = page.locator(f"[data-plot={plot}] [role=img]")
        async with asyncio.timeout(PATIENCE / 1000):
            while not re.search(r": [\d.]+ ", await said.get_attribute("aria-label")):
                await served.clock.advance(0.1)
                await asyncio.sleep(0.05)


async def test_labels_of_new_plots_differ(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.evaluate(WRITTEN)
    await page.click("#tab-plots")
    await page.locator("[data-plot=speed] canvas").wait_for()
    await page.wait_for_selector(r"[data-plot=amperes] b >> text=/^-?\d+\.\d A$/")  # as under State
    for _ in range(3):  # with one value, two, three
        await until_page(page, "window.written.some((texts) => texts.includes('0 s'))")
        for texts in await page.evaluate("window.written"):
            labels = [text for text in texts if text.endswith(" s")]
            assert len(labels) == len(set(labels)), labels
            assert labels[-1:] in ([], ["0 s"])
        await page.evaluate("window.written.length = 0")
        await served.clock.advance(0.3)


async def test_the_wire_shows_requests_and_why_they_fail(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(view="wire")
    await until(lambda: served.robot.tap.watched)
    reader, writer = await asyncio.open_connection(ADDRESS, 40923)
    writer.write(b"command;chassis move x 99;")
    await reader.readuntil(b";")
    await reader.readuntil(b";")
    await page.wait_for_selector("text=x is -5 to 5")
    writer.close()
    await page.click("text=Refused only")
    await becomes(page.locator(".lines > li").count, 1)
    await page.click("text=Refused only")
    await page.locator(".lines li.request .line", has_text="chassis move").click()
    await page.wait_for_selector("text=Copy as nc")


@pytest.mark.slow  # long; in short: test_the_wire_shows_requests_and_why_they_fail
async def test_paused_wire_goes_back_to_the_first_message(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(view="wire")
    await until(lambda: served.robot.tap.watched)
    for number in range(900):
        served.robot.tap.request("slamware", "GET /old", b"GET /old\n\nnumber %d." % number)
        if number % 100 == 99:
            await page.wait_for_selector(f".lines :text('number {number}.')", state="attached")
    await page.click("text=Pause")
    await page.fill("[role=search] input", "/old")
    rows = page.locator(".lines .line")
    for shown in (400, 800, 900):
        await becomes(rows.count, shown)
        if shown < 900:
            await page.click("text=Earlier ones")
    assert "number 0." in await rows.first.inner_text()
    await becomes(page.locator("text=Earlier ones").count, 0)


async def test_stage_break_and_mend_the_robot(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(view="world")
    await page.click("#tab-faults")
    await page.select_option("form select", "emergency_stop")
    await page.click("button:has-text('Inject')")
    await until(lambda: len(served.runtime.fleet.world.stage.faults) == 1)
    await served.clock.advance(0.2)
    assert served.robot[EmergencyStop].engaged
    await page.wait_for_selector(".banner.bad")
    await page.click("li button:has-text('Clear')")
    await until(lambda: len(served.runtime.fleet.world.stage.faults) == 0)
    await served.clock.advance(0.2)


async def test_things_in_the_world_can_be_dragged(served: Served, open_console: OpenConsole) -> None:
    stage = served.runtime.fleet.world.stage
    before = stage.robots[0].pose
    page = await open_console(view="world")
    box = await page.locator("main canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2  # where the robot is
    page.on("dialog", lambda dialog: asyncio.ensure_future(dialog.accept("23")))
    await page.click("[aria-label=Tag], [title=Tag]")
    await page.wait_for_selector("[aria-label=Tag][aria-pressed=true]")
    await page.mouse.click(x + 150, y)
    await until(lambda: len(stage.tags) == 1)
    hung = stage.tags[0]
    assert (hung.kind, hung.text) == ("april", "23")
    await page.wait_for_selector("text=23")
    await page.click("[aria-label=Carry], [title=Carry]")
    await page.wait_for_selector("[aria-label=Carry][aria-pressed=true]")
    await page.mouse.move(x + 150, y)
    await page.mouse.down()
    await page.mouse.move(x + 150, y + 150, steps=4)
    await page.mouse.up()
    await until(lambda: stage.tags[0].pose != hung.pose)
    moved = stage.tags[0].pose
    assert hung.pose.distance_to(before) * math.sqrt(2) == pytest.approx(moved.distance_to(before), rel=0.1)
    assert stage.robots[0].pose == before
    await page.click("li:has-text('23') >> text=Remove")
    await until(lambda: not stage.tags)


async def test_languages_and_themes_change_while_it_runs(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(language="en")
    await page.wait_for_selector("text=Take control")
    await page.click("text=中文")
    await page.wait_for_selector("text=取得控制")
    await shows(page, "[document.documentElement.lang, localStorage.language]", ["zh-CN", "zh"])


async def test_the_floor_that_is_shown_is_chosen(tmp_path: Path, browser: Any) -> None:
    base = load_config(None, {"data": str(tmp_path), "world": "office", "lockstep": True})
    robots = (RobotConfig("a", "universal", free_addresses(1)),)
    runtime = Runtime(replace(base, robots=robots, doors={}, console=ConsoleConfig(port=0)))
    assert runtime.console is not None
    await runtime.start()
    await runtime.console.ready()
    page = await browser.new_page()
    await page.goto(runtime.console.address)
    await page.wait_for_selector("select.floors")
    await becomes(page.locator("select.floors option").count, 4)  # the robot's own and three more
    picture = "document.querySelector('canvas').toDataURL()"
    here = await page.evaluate(picture)
    await page.select_option("select.floors", "2")
    await until_page(page, f"{picture} !== {here!r}")
    await page.close()
    await runtime.close()


async def test_robot_without_a_map_offers_nothing_of_one(tmp_path: Path, browser: Any) -> None:
    base = load_config(None, {"data": str(tmp_path), "world": "empty", "lockstep": True})
    robots = (RobotConfig("a", "robomaster_ep", free_addresses(1)),)
    runtime = Runtime(replace(base, robots=robots, doors={}, console=ConsoleConfig(port=0)))
    assert runtime.console is not None
    await runtime.start()
    await runtime.console.ready()
    page = await browser.new_page(locale="en-GB")
    await page.goto(runtime.console.address)
    await page.wait_for_selector("text=Take control")
    buttons = await page.locator(".tools button, .panel button").evaluate_all(LABELS)
    assert buttons[:2] == ["Move the map", "Ruler"]
    assert not {"Go", "To the dock"} & set(buttons)
    assert "send the robot" not in await page.locator(".hint").inner_text()
    assert await page.evaluate("import('/base.js').then(({ fixed }) => [fixed(-0.001), fixed(-1.26, 1)])") == [
        "0.00",
        "-1.3",
    ]
    await page.click("nav a[href='#/world']")
    await page.wait_for_selector("aside [role=tab] >> text=World")
    assert await page.locator("aside [role=tab]").evaluate_all(LABELS) == ["World", "Faults", "Time"]
    await page.close()
    await runtime.close()


async def test_a_lost_connection_is_said_and_bridged(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.wait_for_selector("text=Take control")
    assert served.runtime.console is not None
    for connection in list(served.runtime.console._connections):
        connection.transport.abort()  # type: ignore[attr-defined]
    await page.wait_for_selector("text=The connection to roboglot is lost.")
    await page.wait_for_selector(".link.good")


async def test_failing_drive_is_said_where_it_began(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.wait_for_selector("text=Scan fits map")
    stop = page.get_by_role("button", name="Emergency stop")
    await stop.press("Enter")
    await page.wait_for_selector("text=Release")
    await shows(page, "document.activeElement.innerText", "Emergency stop")  # the keyboard keeps its place
    box = await page.locator("canvas").bounding_box()
    await page.mouse.click(box["x"] + box["width"] / 2 + 60, box["y"] + box["height"] / 2)
    await page.wait_for_selector(".notice >> text=On the way.")
    await served.clock.advance(1.0)
    await page.wait_for_selector(".notice.bad >> text=the emergency stop is engaged")
    await stop.press("Enter")
    await page.get_by_role("button", name="Release").press("Enter")
    await becomes(page.locator(".banner").count, 0)
    await shows(page, "document.activeElement.className", "stop")
    assert not served.robot[EmergencyStop].engaged


async def test_robot_shown_again_keeps_its_map(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await shows(page, "import('/link.js').then((link) => Boolean(link.grid.value))", True)
    await page.click("nav a[href='#/robots']")
    await page.get_by_role("button", name="Show: a", exact=True).click()
    await page.wait_for_selector("text=Scan fits map")
    assert await page.evaluate("import('/link.js').then((link) => Boolean(link.grid.value))")


@pytest.mark.slow  # a view of its own; tests/console has the maps
async def test_saved_map_is_seen_in_the_grid(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(view="world")
    page.on("dialog", lambda dialog: asyncio.ensure_future(dialog.accept("hall")))
    await served.clock.advance(2.0)  # makes a map
    await page.click("#tab-drawn")
    await page.click("text=Save the map")
    await page.wait_for_selector("text=hall is saved.")
    assert "hall" in await served.robot[MapLibrary].names()
    await page.click("text=Merge")
    await page.click("form >> text=Merge")
    await page.wait_for_selector("text=hall was merged into the map in use.")
    await page.click("nav a[href='#/robots']")
    async with asyncio.timeout(PATIENCE / 1000):
        while not await page.evaluate("document.querySelector('.thumbnail')?.naturalWidth > 0"):  # noqa: ASYNC110
            await asyncio.sleep(0.05)
