"""Attacks of a web page on a robot on the same machine, in a real browser: none works, unless it is let in."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import pytest
import pytest_asyncio

from roboglot.model.events import Event
from tests.browser.served import ADDRESS, FRIEND, REBOUND, STRANGER, Served, becomes

REST = f"http://{ADDRESS}:1448"
POSE, ACTIONS = "/api/core/slam/v1/localization/pose", "/api/core/motion/v1/actions"
MOVE = {"action_name": "slamtec.agent.actions.MoveByAction", "options": {"direction": 0}}
COMMANDS = ";command;blaster fire;chassis move x 0.5;"
TEXT_PORTS = (40921, 40922, 40923, 40925)
OTHER_PORTS = (1448, 50052, 50053)
SAVE = {"type": "task", "id": "1", "operate": "save", "target_id": ["t"], "mode": "single", "condition": "now"}

# Each returns "answered: …" for what a page could read, and the browser's error for what it could not.
FETCH = """async ([url, options]) => {
    try { const r = await fetch(url, options); return 'answered: ' + r.status + ' ' + (await r.text()).slice(0, 200); }
    catch (error) { return String(error); }
}"""
SOCKET = """([url, text]) => new Promise(done => {
    const socket = new WebSocket(url);
    socket.onopen = () => socket.send(text);
    socket.onmessage = event => { socket.close(); done('answered: ' + event.data); };
    socket.onerror = () => done('refused');
})"""
FORM = """([url, kind, value]) => new Promise(done => {
    const frame = document.createElement('iframe');
    frame.name = 'f';
    document.body.append(frame);
    const form = document.createElement('form');
    Object.assign(form, {action: url, method: 'POST', enctype: kind, target: 'f'});
    const area = document.createElement('textarea');
    [area.name, area.value] = ['x', value];
    form.append(area);
    document.body.append(form);
    frame.onload = () => done('loaded');
    setTimeout(() => done('given up'), 700);
    form.submit();
})"""

pytestmark = pytest.mark.asyncio(loop_scope="session")  # one browser and one robot for all tests
Page = Any
Open = Callable[[str], Awaitable[Page]]


@pytest_asyncio.fixture(loop_scope="session")
async def open_page(browser: Any, site: int) -> AsyncIterator[Open]:
    """Open a page of the host; closed when the test ends."""
    context = await browser.new_context()

    async def opened(host: str, port: int = site) -> Page:
        page = await context.new_page()
        await page.goto(f"http://{host}:{port}/")
        return page

    yield opened
    await context.close()


@pytest.fixture
def happened(served: Served) -> list[Event]:
    """Return a list that fills with the robot's events from now on."""
    seen: list[Event] = []
    served.robot.events.listen(Event, seen.append)
    return seen


async def assert_untouched(served: Served, happened: list[Event]) -> None:
    """Assert that no request reached the robot: no action, no program, no event but those of passing time."""
    await served.clock.advance(0.5)
    assert list(served.robot.actions.running()) == []
    assert [event for event in happened if type(event).__name__ in ("ActionChanged", "BeadFired", "Spoke")] == []


async def test_a_stranger_can_neither_read_nor_drive(served: Served, open_page: Open, happened: list[Event]) -> None:
    page = await open_page(STRANGER)
    body = json.dumps(MOVE)
    for path, options in (
        (POSE, {}),
        (ACTIONS, {"method": "POST", "body": body, "headers": {"Content-Type": "application/json"}}),
        (ACTIONS, {"method": "POST", "body": body}),  # a simple request: no preflight
        (f"{ACTIONS}/:current", {"method": "DELETE"}),
    ):
        assert await page.evaluate(FETCH, [REST + path, options]) == "TypeError: Failed to fetch"
    hidden = {"method": "POST", "body": body, "mode": "no-cors"}
    assert await page.evaluate(FETCH, [REST + ACTIONS, hidden]) in ("answered: 0 ", "TypeError: Failed to fetch")
    await assert_untouched(served, happened)


async def test_a_strangers_pictures_consume_no_events(served: Served, open_page: Open) -> None:
    routes = "/api/platform/v1/events"
    page = await open_page(STRANGER)
    async with page.expect_response(REST + routes) as answered:
        await page.evaluate(
            """url => new Promise(done => {
            const picture = new Image();
            picture.onload = picture.onerror = () => done();
            picture.src = url;
        })""",
            REST + routes,
        )
    assert (await answered.value).status == 403


async def test_forms_of_strangers_do_nothing(served: Served, open_page: Open, happened: list[Event]) -> None:
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
        for port, text in ((1448, json.dumps(MOVE)), (40923, COMMANDS)):
            page = await open_page(STRANGER)
            await page.evaluate(FORM, [f"http://{ADDRESS}:{port}{ACTIONS}", kind, text])
            await assert_untouched(served, happened)


async def test_a_post_to_every_port_does_nothing(served: Served, open_page: Open, happened: list[Event]) -> None:
    page = await open_page(STRANGER)
    for port in (*TEXT_PORTS, *OTHER_PORTS):
        for text in (COMMANDS, "\n" * 2000 + COMMANDS, json.dumps(SAVE)):
            options = {"method": "POST", "body": text, "mode": "no-cors"}
            attempt = f"""Promise.race([({FETCH})([{f"http://{ADDRESS}:{port}/"!r}, {json.dumps(options)}]),
                new Promise(done => setTimeout(done, 300, 'silent'))])"""
            assert not (await page.evaluate(attempt)).startswith("answered: 2")
    await assert_untouched(served, happened)


async def test_web_sockets_of_strangers_are_refused(served: Served, open_page: Open) -> None:
    page = await open_page(STRANGER)
    for path in ("programs", "log", "where", "debug"):
        url = f"ws://{ADDRESS}:50053/{path}"
        assert await page.evaluate(SOCKET, [url, json.dumps(SAVE)]) == "refused"


async def test_a_rebound_name_reaches_nothing(served: Served, browser: Any) -> None:
    page = await browser.new_page()
    for path in ("/", POSE, "/openapi.json"):
        answer = await page.goto(f"http://{REBOUND}:1448{path}")
        assert answer.status == 403
        assert await page.evaluate(FETCH, [path, {}]) == f"answered: 403 {await page.inner_text('body')}"[:214]


async def test_a_rebound_name_opens_no_web_socket(served: Served, browser: Any) -> None:
    page = await browser.new_page()
    await page.goto(f"http://{REBOUND}:1448/")  # the host on which the socket is then opened
    assert await page.evaluate(SOCKET, [f"ws://{REBOUND}:50053/programs", json.dumps(SAVE)]) == "refused"


async def refusals(page: Page) -> list[bool]:
    """Return for each frame of a page whether the robot refuses to be there."""
    return ["forbidden: it comes from a web page" in (await frame.content()).lower() for frame in page.frames[1:]]


async def test_strangers_pages_cannot_frame_the_robots(served: Served, open_page: Open) -> None:
    page = await open_page(STRANGER)
    await page.evaluate(
        """url => new Promise(done => {
        const frame = document.createElement('iframe');
        frame.onload = frame.onerror = () => done();
        frame.src = url;
        document.body.append(frame);
    })""",
        f"{REST}/",
    )
    await becomes(lambda: refusals(page), [True])


async def test_friends_and_pages_of_this_machine_are_served(served: Served, open_page: Open) -> None:
    for host in (FRIEND, "localhost", "127.0.0.1"):
        page = await open_page(host)
        answer = await page.evaluate(FETCH, [REST + POSE, {}])
        assert answer.startswith("answered: 200"), host
        headers = {"Content-Type": "application/json"}
        options = {"method": "POST", "body": json.dumps(MOVE), "headers": headers}
        assert (await page.evaluate(FETCH, [REST + ACTIONS, options])).startswith("answered: 20"), host
        frame = await page.evaluate(SOCKET, [f"ws://{ADDRESS}:50053/programs", json.dumps({**SAVE, "body": "1"})])
        assert frame.startswith("answered: "), host


async def test_the_robots_own_page_works(served: Served, browser: Any) -> None:
    page = await browser.new_page()
    answer = await page.goto(f"{REST}/")
    assert answer.status == 200
    assert (await page.evaluate(FETCH, [POSE, {}])).startswith("answered: 200")
