"""The console where names are asked for: signing in and out, buttons by rights, a class, a right that ends."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, replace
from ipaddress import IPv4Address
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
import pytest_asyncio

from roboglot.access.store import AccessStore, Grant, open_store
from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.system.lease import Lease
from roboglot.model.geometry import Pose
from roboglot.operations import Right
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from roboglot.transport.limiter import Limiter
from tests.browser.served import drive_until
from tests.narrowing import known

pytestmark = pytest.mark.asyncio(loop_scope="session")
PASSWORD, LOGINS = "a long password", 3
PATIENCE = 60_000  # ms
FIRST = IPv4Address(free_addresses(2))
HOSTS = {"a": str(FIRST), "b": str(FIRST + 1)}
MAY = {  # what each right allows: stop and drive, draw on the map, break the world
    "see": set[str](),
    "drive": {"stop", "all", "drive"},
    "program": {"stop", "all", "drive"},
    "edit": {"draw"},
    "admin": {"stop", "all", "drive", "draw", "break"},
}
BUTTONS = {
    "stop": ("live", "", ".stop"),
    "all": ("robots", "", "button:has-text('Stop all')"),
    "drive": ("live", "#tab-state", "button:has-text('Take control')"),
    "draw": ("world", "#tab-drawn", "button:has-text('Save the map')"),
    "break": ("world", "#tab-faults", "button:has-text('Inject')"),
}
AXE = (Path(__file__).parent / "vendor" / "axe.min.js").read_text(encoding="utf-8")
TRY = "(body) => fetch('/api/sign_in', {method: 'POST', body}).then((reply) => reply.status)"
FUNCTION = {"blocks": {"blocks": [{"type": "procedures_defnoreturn", "id": "def", "fields": {"NAME": "dance"}}]}}
Page = Any
Open = Callable[..., Awaitable[Page]]


@dataclass(frozen=True, slots=True)
class Guarded:
    """Two robots whose console asks who comes, and the list of who may."""

    runtime: Runtime
    clock: LockstepClock
    store: AccessStore
    url: str

    def add(self, name: str, right: str, robot: str = "*") -> None:
        """Let a person in."""
        rights = frozenset({Right(right)}) if right != "none" else frozenset()
        self.store.add_person(name, PASSWORD, [Grant(robot, rights)] if rights else [])
        assert self.runtime.guard is not None
        self.runtime.guard.reload()

    def forget_tries(self) -> None:
        """Let every address try again."""
        assert self.runtime.guard is not None
        self.runtime.guard._proofs._tries = Limiter(1e-9, LOGINS, lambda: 0.0)


@pytest_asyncio.fixture(scope="module", loop_scope="session")
async def guarded(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Guarded]:
    data = tmp_path_factory.mktemp("guarded")
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    robots = tuple(RobotConfig(name, "universal", host) for name, host in HOSTS.items())
    access = AccessConfig(on=True, local=False, logins=LOGINS, connections=200)
    runtime = Runtime(replace(base, robots=robots, access=access, console=ConsoleConfig(port=0)))
    assert isinstance(runtime.clock, LockstepClock)
    assert runtime.console is not None
    store = open_store(data)
    await runtime.start()
    await runtime.console.ready()
    yield Guarded(runtime, runtime.clock, store, runtime.console.address)
    store.close()
    await runtime.close()


@pytest_asyncio.fixture(loop_scope="session")
async def open_page(browser: Any, guarded: Guarded) -> AsyncIterator[Open]:
    contexts = []

    async def open_it(path: str = "/") -> Page:
        context = await browser.new_context(viewport={"width": 1280, "height": 800})
        contexts.append(context)
        await context.add_init_script("localStorage.language = 'en'")
        page = await context.new_page()
        page.set_default_timeout(PATIENCE)
        await page.goto(guarded.url + path)
        return page

    yield open_it
    for context in contexts:
        await context.close()


async def until(condition: Callable[[], bool]) -> None:
    """Wait, in the machine's time, for what a page sent."""
    async with asyncio.timeout(PATIENCE / 1000):
        while not condition():  # noqa: ASYNC110 - a page has no event of ours
            await asyncio.sleep(0.02)


async def sign_in(page: Page, name: str, password: str = PASSWORD) -> None:
    await page.fill("input[name=name]", name)
    await page.fill("input[name=password]", password)
    await page.click("form .main")


async def offered(page: Page, what: str) -> bool:
    """Return whether a button is on; one that is off must say why."""
    view, tab, button = BUTTONS[what]
    await page.evaluate(f"location.hash = '#/{view}'")
    if tab:
        await page.click(tab)
    await page.wait_for_selector(button)
    off = await page.get_attribute(button, "aria-disabled") == "true"
    if off:
        assert "lack the right to" in await page.get_attribute(button, "title")
    return not off


async def test_account_names_itself_and_misses_the_class(guarded: Guarded, open_page: Open) -> None:
    guarded.add("drew", "drive")
    page = await open_page("/?robot=b")  # as the fleet's page names it
    await sign_in(page, "drew")
    await page.wait_for_selector("text=Take control")
    assert await page.locator("header select").input_value() == "b"
    assert await page.locator("text=Your name").count() == 0  # control is taken under the account's
    await page.evaluate("location.hash = '#/class'")
    await page.wait_for_selector("main >> text=/Refused: opening and leading a class needs/")


async def test_buttons_follow_rights_that_change(guarded: Guarded, open_page: Open) -> None:
    """The other roles in one page, which comes back by itself when a right is lost."""
    guarded.add("several", "admin")
    [several] = [identity for identity in guarded.store.identities() if identity.name == "several"]
    page = await open_page()
    await sign_in(page, "several")
    for right in ("admin", "program", "edit", "see"):
        guarded.store.put(replace(several, grants=(Grant("*", frozenset({Right(right)})),)))
        known(guarded.runtime.guard).reload()
        for what, (view, tab, button) in BUTTONS.items():
            await page.evaluate(f"location.hash = '#/{view}'")
            if tab:
                await page.click(tab)
            on = ":not([aria-disabled=true])" if what in MAY[right] else "[aria-disabled=true]"
            name, _, words = button.partition(":")
            await page.wait_for_selector(name + on + (f":{words}" if words else ""))


@pytest.mark.slow  # in short: test_buttons_are_on_for_those_who_may
async def test_studio_says_which_right_its_buttons_need(guarded: Guarded, open_page: Open) -> None:
    guarded.add("driver", "drive")
    page = await open_page("/?to=studio")
    await sign_in(page, "driver")
    for button in (".controls .main", "button:has-text('Step')"):
        await page.wait_for_selector(f"{button}[aria-disabled=true][title='You lack the right to program.']")
    assert await page.get_attribute(".stop", "aria-disabled") is None
    await page.keyboard.press("F5")
    await page.wait_for_selector(".notice.bad >> text=You lack the right to program.")
    await page.evaluate("state => studio.editor.load(state)", FUNCTION)
    await page.locator("[data-id=def] > .blocklyPath").first.click(button="right", position={"x": 12, "y": 12})
    words = "Keep as a module: You lack the right to program."
    await page.wait_for_selector(f".blocklyMenuItemDisabled >> text={words}")
    await page.keyboard.press("Escape")
    await page.click("#tab-group")
    lacking = "[title='You lack the right to admin on all robots.']"
    await page.wait_for_selector(f"button:has-text('Open a class'){lacking}")
    await page.click("button:has-text('Programs')")
    await page.wait_for_selector("dialog button:has-text('New, in Python'):not([aria-disabled])")  # one's own
    if folder := os.environ.get("ROBOGLOT_PICTURES"):
        await page.screenshot(path=f"{folder}/studio-right.png")


SLOW = [pytest.param(who, marks=pytest.mark.slow) for who in ("none", "see", "program", "edit", "admin")]


@pytest.mark.parametrize("who", ["drive", *SLOW])  # the others, in one page: above
async def test_buttons_are_on_for_those_who_may(guarded: Guarded, open_page: Open, who: str) -> None:
    guarded.add(who, who)
    page = await open_page()
    await sign_in(page, who)
    if who == "none":
        await page.wait_for_selector("text=no right to see any of these robots")
        return
    await page.wait_for_selector("text=Scan fits map")
    assert await page.locator("text=Tap to send the robot").count() == int("drive" in MAY[who])
    assert {what for what in BUTTONS if await offered(page, what)} == MAY[who], who
    cookies = await page.context.cookies()
    assert {(c["httpOnly"], c["sameSite"]) for c in cookies} == {(True, "Strict")}
    assert sorted(c["path"] for c in cookies) == ["/", "/api/sign_in"]
    assert await page.evaluate("document.cookie") == ""


@pytest.mark.slow  # tests/console has the sessions
async def test_signing_out_ends_the_session(guarded: Guarded, open_page: Open) -> None:
    guarded.add("anna", "drive")
    page = await open_page()
    await page.wait_for_selector(".sign")
    if folder := os.environ.get("ROBOGLOT_PICTURES"):
        await page.screenshot(path=f"{folder}/sign.png")
    await page.evaluate(AXE)
    assert await page.evaluate("axe.run(document).then((found) => found.violations.map((v) => v.id))") == []
    await sign_in(page, "anna")
    await page.wait_for_selector("text=Scan fits map")
    [cookie] = [c for c in await page.context.cookies() if c["path"] == "/"]
    await page.click("header button:has-text('anna')")
    await page.wait_for_selector("input[name=password]")
    assert await page.locator("text=Your session has ended").count() == 0  # it was wished
    await page.context.add_cookies([cookie])  # a copied cookie is worthless
    assert await page.evaluate("fetch('/api/robots').then((r) => r.status)") == 401


@pytest.mark.slow  # a layout of its own
async def test_header_of_phone_has_room_for_a_name(guarded: Guarded, open_page: Open) -> None:
    guarded.add("a-person-with-a-long-name", "drive")
    page = await open_page()
    await page.set_viewport_size({"width": 360, "height": 740})
    await sign_in(page, "a-person-with-a-long-name")
    await page.wait_for_selector("text=Scan fits map")
    boxes = [await item.bounding_box() for item in await page.locator("header > *:visible").all()]
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= 360 for box in boxes)
    assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    if folder := os.environ.get("ROBOGLOT_PICTURES"):
        await page.screenshot(path=f"{folder}/phone.png")


async def test_token_signs_in_and_its_rotation_signs_out(guarded: Guarded, open_page: Open) -> None:
    token = guarded.store.add_machine("cell7", [Grant("b", frozenset({Right.DRIVE}))])
    known(guarded.runtime.guard).reload()
    page = await open_page()
    await page.click("text=Token")
    await page.fill("input[name=token]", token)
    await page.click("form .main")
    await page.wait_for_selector("text=Scan fits map")
    assert await page.locator("header option").all_inner_texts() == ["b"]
    await page.evaluate("location.hash = '#/world'")
    await page.wait_for_selector("text=Only those who may see all robots see the world")
    guarded.store.rotate("cell7")
    known(guarded.runtime.guard).reload()
    await page.wait_for_selector(".sign >> text=Your session has ended")


def post(url: str, password: str, cookie: str, token: str = "") -> tuple[int, list[str]]:
    """Return the status of gina's log-in, or of a token's, and the cookies that it sets."""
    body = json.dumps({"token": token} if token else {"name": "gina", "password": password}).encode()
    try:
        with urlopen(Request(f"{url}/api/sign_in", data=body, headers={"Cookie": cookie}), timeout=60) as reply:
            return reply.status, [text.partition(";")[0] for text in reply.headers.get_all("set-cookie")]
    except HTTPError as error:
        with error:
            return error.code, []


async def test_guesses_do_not_stop_a_new_log_in(guarded: Guarded) -> None:
    guarded.add("gina", "see")
    guarded.forget_tries()

    async def status(password: str = PASSWORD, cookie: str = "") -> tuple[int, list[str]]:
        return await asyncio.to_thread(post, guarded.url, password, cookie)

    _, [_, device] = await status()
    for _ in range(LOGINS):
        assert (await status("a guess"))[0] == 401
    assert (await status())[0] == 429
    allowed, [_, again] = await status(cookie=device)
    assert (allowed, again) == (200, device)
    token = guarded.store.add_machine("gina-tablet", [Grant("*", frozenset({Right.SEE}))])
    known(guarded.runtime.guard).reload()
    assert (await asyncio.to_thread(post, guarded.url, "", "", token))[0] == 200  # a new browser need not wait
    guarded.forget_tries()


@pytest.mark.slow  # tests/access/test_guard.py has the limits
async def test_guesses_are_limited_and_differ_from_nothing(guarded: Guarded, open_page: Open) -> None:
    guarded.add("ben", "see")
    guarded.forget_tries()
    page = await open_page()
    await sign_in(page, "ben", "a wrong password")
    await page.wait_for_selector("text=is not valid")
    for name in ("unknown", "ben"):
        body = json.dumps({"name": name, "password": "a wrong password"})
        assert await page.evaluate(TRY, body) == 401
    await sign_in(page, "ben", "another wrong one")
    await page.wait_for_selector("text=too many wrong passwords")
    guarded.forget_tries()


async def test_a_driver_whose_right_is_revoked_stands(guarded: Guarded, open_page: Open) -> None:
    robot = guarded.runtime.fleet.robots["a"]
    guarded.add("carl", "drive", "a")
    page = await open_page()
    await sign_in(page, "carl")
    await page.wait_for_selector("text=Scan fits map")
    await page.click("#tab-drive")
    box = await page.locator(".pad").bounding_box()
    await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
    await page.mouse.down()
    await until(lambda: any(action.name == "drive" for action in robot.actions.running()))
    await drive_until(robot, guarded.clock, lambda: robot[Base].velocity.speed > 0.1)
    guarded.store.revoke("carl")
    known(guarded.runtime.guard).reload()
    await guarded.clock.advance(0.5)
    assert robot[Base].velocity.speed < 0.02
    await page.wait_for_selector("text=Your rights have changed")
    await page.wait_for_selector(".sign")
    await page.mouse.up()
    assert robot.actions.running() == []


@pytest.mark.slow  # in short: test_a_driver_whose_right_is_revoked_stands
async def test_reduced_right_leaves_the_page_with_the_rest(guarded: Guarded, open_page: Open) -> None:
    guarded.add("dora", "drive", "a")
    page = await open_page()
    await sign_in(page, "dora")
    await page.wait_for_selector("text=Scan fits map")
    assert await offered(page, "drive")
    [dora] = [identity for identity in guarded.store.identities() if identity.name == "dora"]
    guarded.store.put(replace(dora, grants=(Grant("a", frozenset({Right.SEE})),)))
    known(guarded.runtime.guard).reload()
    await page.wait_for_selector("button[aria-disabled=true]:has-text('Take control')")


@pytest.mark.slow  # long; in short: test_studio_class.py
async def test_pupils_join_by_code_and_the_teacher_leads(guarded: Guarded, open_page: Open) -> None:
    guarded.add("teacher", "admin")
    teacher = await open_page()
    await sign_in(teacher, "teacher")
    await teacher.wait_for_selector("text=Scan fits map")
    await teacher.click("nav >> text=Class")
    await teacher.fill("input[name=name]", "5b")
    await teacher.click("form .main")
    code = await teacher.inner_text("output.code")
    pupils = []
    for name in ("Emil", "Frida"):
        page = await open_page(f"/?code={code}")
        await page.fill("input[name=name]", name)
        await page.click("form .main")
        await page.wait_for_selector("text=Scan fits map")
        assert await page.locator("nav >> text=Class").count() == 0
        pupils.append(page)
    shown = [await page.locator("header option").all_inner_texts() for page in pupils]
    assert sorted(shown) == [["a"], ["b"]]
    assert await pupils[0].evaluate("fetch('/api/class').then((r) => r.status)") == 403
    record = "fetch('/api/recording', {method: 'POST', body: '{\"do\": \"start\"}'}).then((r) => r.status)"
    assert await pupils[0].evaluate(record) == 403
    assert await pupils[0].evaluate("fetch('/api/recordings').then((r) => r.status)") == 403
    emils = shown[0][0][-1]
    await teacher.wait_for_selector(".tile:has-text('Frida'):has-text('here')")
    if folder := os.environ.get("ROBOGLOT_PICTURES"):
        await teacher.screenshot(path=f"{folder}/class.png")

    await teacher.click(".tile:has-text('Emil') >> text=Lock")
    await until(lambda: guarded.runtime.fleet.robots[emils][Lease].taken_by == "console teacher")
    take = "import('/link.js').then((link) => link.ask(link.current.value, 'take_control')).catch((e) => e.message)"
    assert await pupils[0].evaluate(take) == f"the teacher has locked robot {emils}"
    await teacher.click(".tile:has-text('Emil') >> text=Unlock")
    await until(lambda: guarded.runtime.fleet.robots[emils][Lease].taken_by == "")

    stage = guarded.runtime.fleet.world.stage
    stage.place(emils, Pose(5.0, 5.0, 1.0))
    await teacher.click(".tile:has-text('Emil') >> text=Reset")
    await until(lambda: next(r.pose for r in stage.robots if r.name == emils).distance_to(Pose(5.0, 5.0)) > 1.0)

    await teacher.click(".tile:has-text('Emil') >> text=Give back")
    await pupils[0].wait_for_selector(".sign")
    await teacher.wait_for_selector(".tile:has-text('Emil')", state="detached")
    teacher.on("dialog", lambda dialog: asyncio.ensure_future(dialog.accept()))
    await teacher.click("text=End the class")
    await pupils[1].wait_for_selector(".sign")
    assert await pupils[1].evaluate("fetch('/api/robots').then((r) => r.status)") == 401


@pytest.mark.slow  # tests/console/test_studio_socket.py has the limits
async def test_wrong_codes_are_limited(guarded: Guarded, open_page: Open) -> None:
    page = await open_page("/?code=NOTONE")
    statuses = await page.evaluate("""async () => { const found = []; for (let i = 0; i < 12; i++) {
        const body = JSON.stringify({name: 'x', code: 'WRONG' + i});
        found.push((await fetch('/api/sign_in', {method: 'POST', body})).status);
    } return found; }""")
    assert statuses == [401] * 10 + [429] * 2
