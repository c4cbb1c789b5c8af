"""The console beside a lost, silent or other server, in a real browser: nothing old is shown as if it were new."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.console.live import Page as ServerPage
from roboglot.model.components.logistics.delivery import Delivery, OrderKind, OrderRequest
from roboglot.model.components.mapping.places import Places
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from tests.browser.served import PATIENCE, OpenConsole, Page, Served, becomes, shows, until

pytestmark = pytest.mark.asyncio(loop_scope="session")
QUICKLY = """() => {
    const now = performance.now.bind(performance);
    let later = 0;
    performance.now = () => now() + (later += 11_000);
}"""
OTHER_ROBOTS = """() => import('/link.js').then((link) => {
    link.scan.value = {};
    link.hello.value = { ...link.hello.value, robots: [{ name: 'z', rights: [], simulated: true }] };
    return [link.current.value, link.scan.value, link.grid.value];
})"""


LIST = ".card:nth-child(3) li"
ORDERS = f"""[...document.querySelectorAll('{LIST}')].map((order) =>
    [...order.querySelectorAll('b, .badge')].map((part) => part.textContent).join(' '))"""
# What the page sends, as values.
NOTED = """() => {
    const { send } = WebSocket.prototype;
    window.sent = [];
    WebSocket.prototype.send = function (text) { window.sent.push(JSON.parse(text)); send.call(this, text); };
}"""
TWIN = """() => import('/link.js').then((link) => {
    const { robots } = link.hello.value, { a } = link.states.value;
    link.states.value = { a, z: a };
    link.hello.value = { ...link.hello.value, robots: [...robots, { ...robots[0], name: 'z' }] };
    link.choose('z');
    return sent.filter((one) => one.robot === 'z' && one.type === 'drive').map((one) => one.x);
})"""


async def watched(served: Served) -> None:
    async with asyncio.timeout(PATIENCE):
        while not served.robot.tap.watched:  # noqa: ASYNC110 - a page has no event of ours
            await asyncio.sleep(0.02)


async def reconnect(served: Served, page: Page) -> None:
    """Cut the page's connection, and wait until it is there again."""
    assert served.runtime.console is not None
    for connection in list(served.runtime.console._connections):
        connection.transport.abort()  # type: ignore[attr-defined]
    await page.wait_for_selector("text=The connection to roboglot is lost.")
    await page.wait_for_selector(".link.good")


async def test_silent_server_counts_as_lost(
    served: Served, open_console: OpenConsole, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = await open_console()
    await page.wait_for_selector(".link.good >> text=ms")
    with monkeypatch.context() as patch:
        patch.setattr(ServerPage, "_reply", lambda *_: None)
        await page.evaluate(QUICKLY)
        await page.wait_for_selector("text=Driving by hand has stopped, other actions may go on;")
        await page.evaluate("delete performance.now")
    await page.wait_for_selector(".link.good >> text=ms")


async def test_reconnected_wire_shows_each_message_once(served: Served, open_console: OpenConsole) -> None:
    page = await open_console(view="wire")
    await watched(served)
    served.robot.tap.request("slamware", "GET /before", b"")
    await page.wait_for_selector(".lines >> text=GET /before")
    before = await page.locator(".lines .line").count()
    await reconnect(served, page)
    await watched(served)
    served.robot.tap.request("slamware", "GET /after", b"")
    await page.wait_for_selector(".lines >> text=GET /after")
    assert await page.locator(".lines >> text=GET /before").count() <= 1
    assert await page.locator(".lines .line").count() <= before + 1


async def test_gone_robot_leaves_nothing_drawn(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.wait_for_selector("text=Scan fits map")
    assert await page.evaluate(OTHER_ROBOTS) == ["z", None, None]
    await page.wait_for_selector(".notice.bad >> text=Robot a is not here any more: this page shows robot z now.")


async def test_held_key_does_not_drive_another_robot(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-drive")
    await page.focus(".pad")
    await page.evaluate(NOTED)
    await page.keyboard.down("w")
    await until(page, "sent.some((one) => one.robot === 'a' && one.x > 0)")
    assert await page.evaluate(TWIN) == [0]  # at once: not after another command
    await page.keyboard.down("w")  # which repeats
    assert not await page.evaluate("sent.some((one) => one.robot === 'z' && one.x > 0)")
    await page.keyboard.up("w")


async def test_page_without_connection_says_so(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-actions")
    await page.wait_for_selector("text=Record")
    await page.context.set_offline(True)
    await page.click("button:has-text('Record')")
    await page.wait_for_selector(".notice.bad >> text=Refused: No connection")
    await page.context.set_offline(False)
    await page.click("#tab-state")
    await page.wait_for_selector("text=All is well.")
    await page.evaluate("import('/link.js').then((link) => { link.status.value = 'lost'; })")
    for view, place in (("live", "#panel"), ("robots", ".tile")):
        await page.evaluate(f"location.hash = '#/{view}'")
        await page.wait_for_selector(f"{place} .warned >> text=Last known:")
        assert await page.locator(".allwell, .thumbnail").count() == 0


async def test_orders_wait_after_a_stop(open_console: OpenConsole, served: Served) -> None:
    """The page called a robot idle that carried out an order, and a stopped one drove on with the next."""
    robot = served.robot
    await robot[Places].put(PointOfInterest("r", Pose(2.0, 0.0), {"display_name": "room"}))
    await robot[Delivery].accept(OrderRequest(OrderKind.FOOD, "room"), OrderRequest(OrderKind.GUIDE, "room"))
    page = await open_console(language="zh")
    await page.click("#tab-actions")
    await shows(page, ORDERS, ["送餐到 room 执行中", "带人去 room 等待中"])
    await page.evaluate("location.hash = '#/robots'")
    await until(page, "document.querySelector('.tile')?.textContent.includes('正在前往 room')")
    await page.evaluate("location.hash = '#/live'")
    await page.click(".stop")
    await becomes(lambda: asyncio.sleep(0, robot[Delivery].executing), wanted=False)
    await page.reload()
    await until(page, "document.querySelector('.banner')?.textContent.includes('订单在等待')")
    await page.click("#tab-actions")
    await served.clock.advance(2.0)  # the robot brakes, and the order under way has failed
    await shows(page, f"document.querySelectorAll('{LIST} button').length", 1)
    await page.click(f"{LIST} button")
    await shows(page, f"document.querySelectorAll('{LIST} button').length", 0)
    await page.click(".banner button")
    await until(page, "!document.querySelector('.banner')")
    assert robot[Delivery].executing
