"""Layout of the console: all of it can be seen, touched and read aloud, on a phone as on a big screen."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

from roboglot.console.recordings.running import RecordingRequest
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.shards.overview import Overview
from roboglot.shards.snapshots import Snapshots
from tests.browser.served import PAGE_PATIENCE, PATIENCE, STILL, OpenConsole, Page, Served, becomes
from tests.browser.served import until as until_page
from tests.narrowing import known
from tests.shards.test_overview import Console, fleet_of

pytestmark = pytest.mark.asyncio(loop_scope="session")
AXE = (Path(__file__).parent / "vendor" / "axe.min.js").read_text(encoding="utf-8")
VIEWS = {
    "live": ("state", "drive", "actions", "plots"),
    "world": ("people", "faults", "drawn", "clock"),
    "robots": (),
    "recordings": (),
    "wire": (),
    "class": (),
}
SMALL_TARGETS = """() => [...document.querySelectorAll('button, a, select, input')]
    .filter(e => e.offsetParent && e.type !== 'range')
    .filter(e => { const b = e.getBoundingClientRect(); return b.width && (b.height < 44 || b.width < 44); })
    .filter(e => !e.classList.contains('line'))
    .map(e => e.outerHTML.slice(0, 80))"""

# The share of the map's pixels that have the theme's colour of free floor, as the browser reads that colour.
FREE_FLOOR = """() => {
    const probe = document.body.appendChild(document.createElement('i'));
    probe.style.color = 'var(--map-free)';
    const [r, g, b] = getComputedStyle(probe).color.match(/\\d+/g).map(Number);
    probe.remove();
    const map = document.querySelector('canvas');
    const { data } = map.getContext('2d').getImageData(0, 0, map.width, map.height);
    let free = 0;
    for (let i = 0; i < data.length; i += 4) free += data[i] === r && data[i + 1] === g && data[i + 2] === b;
    return 4 * free / data.length;
}"""
LOW = """() => import('/link.js').then((link) => {
    const { a } = link.states.value, level = 'WARNING', name = 'battery low';
    const battery = { ...a.battery, remaining: 1380 }, faults = [{ id: 1, name, level, message: 'low battery' }];
    link.states.value = { a: { ...a, battery, faults } };
})"""
DRAWN = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))"
TALLER = "document.scrollingElement.scrollHeight - innerHeight"  # px
COVERED_OR_CUT = """() => {
    const pen = document.createElement('canvas').getContext('2d');
    const width = (e, text) => { pen.font = getComputedStyle(e).font; return pen.measureText(text).width; };
    const bad = [], blame = (what, e) => bad.push(`${what}: ${e.outerHTML.slice(0, 90)}`);
    for (const e of document.querySelectorAll('button, a, select, input, h2, h3')) {
        const b = e.getBoundingClientRect(), x = b.x + b.width / 2, y = b.y + b.height / 2;
        const top = document.elementFromPoint(x, y);
        let pane = e.parentElement;
        while (pane && !/auto|scroll/.test(getComputedStyle(pane).overflowY)) pane = pane.parentElement;
        if (!e.checkVisibility() || b.width < 2) continue;
        const shown = pane?.getBoundingClientRect();
        if (shown && (y < shown.top || y > shown.bottom)) continue; // scrolled away
        if (!top) { if (!e.closest('.unseen')) blame('beyond', e); continue; }
        if (!e.contains(top) && !top.contains(e) && !top.closest('label')) blame('covered', e);
        const room = e.clientWidth - parseFloat(getComputedStyle(e).paddingLeft);
        if (e.matches('select') && width(e, e.selectedOptions[0]?.text ?? '') > room) blame('cut', e);
        if (e.matches('button, a, h2, h3') && e.scrollWidth > e.clientWidth + 1 && e.clientWidth) blame('cut', e);
    }
    return bad;
}"""


async def test_free_floor_has_the_colour_of_each_theme(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await served.clock.advance(3.0)
    themes = set[str]()
    for _ in range(2):
        await page.click("[aria-label='Dark or light']")
        themes.add(await page.locator("html").get_attribute("data-theme"))
        await until_page(page, f"({FREE_FLOOR})() > 0.05")
    assert themes == {"light", "dark"}


async def test_low_screens_show_everything(served: Served, open_console: OpenConsole) -> None:
    """A phone on its side, and a small screen with everything twice as large."""
    page = await open_console()
    for view in ("live", "wire", "world", "robots", "class"):
        await page.evaluate(f"location.hash = '#/{view}'")
        await page.wait_for_selector(f"nav a[href='#/{view}'][aria-current=page]")
        await page.wait_for_selector("main > :not(.empty)")
        for width, height in ((844, 390), (640, 400)):
            await page.set_viewport_size({"width": width, "height": height})
            await page.evaluate(DRAWN)
            assert await page.evaluate(COVERED_OR_CUT) == [], (view, width)


async def test_narrowest_phones_reach_every_button(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(viewport={"width": 320, "height": 568})
    beyond = """[...document.querySelectorAll('button, a, select, input')].filter((one) => {
        const { right, width } = one.getBoundingClientRect(); return width && right > innerWidth + 1;
    }).map((one) => one.textContent)"""
    for path, shown in (("/#/recordings", "nav .seldom[aria-current]"), ("/studio/", ".start button")):
        await page.goto(page.url.split("/#")[0] + path)
        await page.wait_for_selector(shown)
        assert await page.evaluate(beyond) == [], path


async def test_banners_on_low_screens_cover_nothing(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    served.robot[EmergencyStop].engage()
    try:
        await page.wait_for_selector(".banner")
        for width, height in ((844, 390), (640, 400)):
            await page.set_viewport_size({"width": width, "height": height})
            await page.evaluate(DRAWN)
            assert await page.evaluate(COVERED_OR_CUT) == [], width
    finally:
        served.robot[EmergencyStop].release()


async def test_phone_shows_and_can_touch_everything(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    for view in ("live", "wire", "world", "robots", "class"):
        await page.evaluate(f"location.hash = '#/{view}'")
        await page.wait_for_selector(f"nav a[href='#/{view}'][aria-current=page]")
        await page.wait_for_selector("main > :not(.empty)")
        assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth"), view
        for language in ("EN", "中文"):
            if await (other := page.locator(f"header >> text={language}")).count():
                await other.click()
            await page.wait_for_selector(f"html[lang={'en' if language == 'EN' else 'zh-CN'}]")
            assert await page.evaluate(COVERED_OR_CUT) == [], view
        stop = await page.locator(".stop").bounding_box()
        assert stop["x"] + stop["width"] <= 360
        assert await page.evaluate(SMALL_TARGETS) == [], view
        if view in ("live", "world"):  # no tool has a name to see there
            assert await page.locator(".hint").is_visible()
        if view == "robots":
            await page.evaluate("document.querySelector('.tile h2').firstChild.data = 'robot_of_a_class_'.repeat(5)")
            assert await page.evaluate(COVERED_OR_CUT) == []


async def test_times_and_faults_are_said_once(served: Served, open_console: OpenConsole) -> None:
    """A time known to the minute has no seconds; a fault whose sentence has the words of its name has them once."""
    page = await open_console()
    await page.wait_for_selector("text=Scan fits map")
    await page.evaluate(LOW)
    await page.wait_for_selector("text=/ 23 min left$/")
    assert await page.inner_text(".faults li") == "battery low"


async def test_text_counts_the_dock_that_is_drawn(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    assert served.robot[Docking].home is not None
    await page.click("text=What the map shows, as text")
    await page.wait_for_selector("text=Drawn on the map: lines 0, areas 0, docks 1.")


async def test_only_panels_scroll(served: Served, open_console: OpenConsole) -> None:
    """Text for screen readers must not make the page taller: the focus would scroll *Stop* away for good."""
    page = await open_console(viewport={"width": 1280, "height": 400})
    await page.click("#tab-drive")
    await page.wait_for_selector("input[name=text]")
    assert await page.evaluate(TALLER) == 0
    await page.click("nav a[href='#/wire']")
    await becomes(lambda: page.evaluate("import('/link.js').then((link) => link.wanted.value.wire)"), True)
    async with asyncio.timeout(PATIENCE):
        while not served.robot.tap.watched:  # noqa: ASYNC110 - a page has no event of ours
            await asyncio.sleep(0.02)
    for number in range(40):
        served.robot.tap.request("slamware", f"GET /{number}", b"")
    await page.wait_for_selector(".lines >> text=GET /39", state="attached")
    assert await page.evaluate(TALLER) == 0


@pytest.mark.parametrize("theme", ["dark", pytest.param("light", marks=pytest.mark.slow)])
async def test_axe_finds_nothing_serious(theme: str, served: Served, open_console: OpenConsole) -> None:
    await served.clock.advance(1.0)
    page = await open_console(color_scheme=theme)
    await page.evaluate(AXE)
    for view, tabs in VIEWS.items():
        await page.click(f"nav a[href='#/{view}']")
        for tab in tabs or ("",):
            if tab:
                await page.click(f"#tab-{tab}")
            await page.wait_for_selector("main > :not(.empty)")
            assert await serious_in(page) == [], (view, tab, theme)


async def serious_in(page: Page) -> list[tuple[str, list[str]]]:
    """Return what axe, which the page must have, finds serious."""
    found = await page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
    return [
        (violation["id"], [node["html"][:120] for node in violation["nodes"][:3]])
        for violation in found["violations"]
        if violation["impact"] in ("serious", "critical") or violation["id"] == "heading-order"
    ]


async def test_watched_recording_fits_on_a_phone(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    recordings = known(known(served.runtime.console)._desk.recordings)
    await recordings.do(RecordingRequest("start"))
    await recordings.do(RecordingRequest("mark", text="a mark with words of one's own " * 3))
    await served.clock.advance(3.0)
    served.robot.tap.request("slamware", "GET /a/long/path" * 9, b"{}")
    ended = await recordings.do(RecordingRequest("stop"))
    try:
        await page.evaluate("location.hash = '#/recordings'")
        await page.click("main li button:has-text('Watch')")
        await page.wait_for_selector("text=Nothing in these seconds.", state="detached")
        await page.wait_for_selector("[aria-label=Play]")  # it has come to its end
        await page.evaluate(AXE)
        for language in ("EN", "中文"):
            if await (other := page.locator(f"header >> text={language}")).count():
                await other.click()
            await page.wait_for_selector(f"html[lang={'en' if language == 'EN' else 'zh-CN'}]")
            assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth")
            assert await page.evaluate(COVERED_OR_CUT) == []
            assert await page.evaluate(SMALL_TARGETS) == []
            assert await serious_in(page) == []
    finally:
        await recordings.do(RecordingRequest("delete", str(ended["file"])))


class Calm(Console):
    """A console whose robots have all that a tile shows."""

    async def fetch(self, *path: str, body: bytes | None = None) -> bytes:
        if path[-1] == "map.png":
            return await super().fetch(*path, body=body)
        shown = {"safety": {}, "control": {}, "faults": [], "actions": [], "parts": ["mapping"]}
        return json.dumps(shown | {"battery": {"charge": 0.5}}).encode()


async def test_fleet_page_filters_its_robots(browser: Any, tmp_path: Path) -> None:
    fleet = Overview(fleet_of(9, tmp_path), "127.16.3.1", 0)
    fleet._snapshots = Snapshots(fleet._fleet_host, Calm)
    fleet.open()
    await fleet.ready()
    context = await browser.new_context(viewport={"width": 390, "height": 844}, **STILL)
    page = await context.new_page()
    page.set_default_timeout(PAGE_PATIENCE)
    await page.goto(fleet.address)
    tiles = page.locator("li.tile h2")
    await becomes(tiles.count, 9)
    await page.locator("input[type=search]").fill(" A7")
    await becomes(tiles.all_inner_texts, ["Robot a7\nuniversal · 127.16.3.7"])
    assert await page.get_by_role("status").inner_text() == "Robots shown: 1 of 9"
    await page.locator("input[type=search]").fill("FAILED")
    await becomes(tiles.count, 1)
    assert await page.evaluate(SMALL_TARGETS) == []
    assert await page.locator("header .brand").is_visible()
    await page.locator("input[type=search]").fill("a2")
    await page.wait_for_selector(".tile:has(.thumbnail) >> text=All is well.")
    assert str(await page.locator(".tile a").get_attribute("href")).endswith("/?robot=a2#/live")
    await fleet.close()  # the page says so where it is seen, and calls no robot well
    await page.wait_for_selector(".tile >> text=Last known:")
    assert await page.locator(".allwell, .thumbnail").count() == 0
    for width in (390, 1280):
        await page.set_viewport_size({"width": width, "height": 844})
        banner = await page.locator(".banner.bad").bounding_box()
        assert (banner["x"], banner["width"]) == (0, width)
        assert banner["y"] < 100
    await context.close()
