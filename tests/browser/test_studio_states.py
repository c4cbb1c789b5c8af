"""The state of a run in Chromium: the page says what it knows, and no more."""

from __future__ import annotations

import json

import pytest

from roboglot.console.studio.channel import Session
from roboglot.model.components.system.lease import TEACHER, Lease
from tests.browser.served import Served, Tabs, shows, until
from tests.browser.test_console_link import QUICKLY
from tests.browser.test_studio import COUNTING, FOREVER, READY, Open, Page, loaded, phase, prints, studio

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")
COLOUR = "name => getComputedStyle(document.querySelector(name)).backgroundColor"
ENDED = "ended by the user"
WORD = "document.querySelector('.phase').textContent"
ONLINE = "import('/studio/link.js').then(link => link.online.value)"


async def opens_text(page: Page, text: str) -> None:
    given = {"kind": "text", "body": text}
    await page.evaluate("given => import('/studio/program.js').then(p => { p.show(given); p.changed(); })", given)
    await page.wait_for_selector(".cm-content")


# What the pages keep in the browser.
KEPT = (
    "language", "theme", "person", "robot", "studio.recent", "studio.stars", "studio.look", "studio.class",
    "studio.role", "studio.tab", "studio.unsent",
)  # fmt: skip


async def test_studio_says_who_alone_may_move(studio: Open, served: Served) -> None:
    page, lease = await studio(), served.robot[Lease]
    for who, said in (
        (TEACHER, "The teacher has locked this robot: until it is unlocked, programs cannot move it."),
        ("console anna", "Only console anna may move this robot at the moment: programs cannot."),
        ("visual", None),
        (TEACHER, "The teacher has locked this robot: until it is unlocked, programs cannot move it."),
        ("", None),
    ):
        await (lease.take(who) if who else lease.release())
        await shows(page, "document.querySelector('.banner')?.textContent ?? null", said)


async def test_line_of_a_running_text_is_lit(studio: Open) -> None:
    page = await studio()
    await opens_text(page, f"import time\nprint({ENDED!r})\ntime.sleep(1000)\n")  # of robot time, which stands still
    await page.keyboard.press("F5")
    await until(page, "document.querySelector('.cm-line.here')?.textContent === 'time.sleep(1000)'")
    colours = [await page.evaluate(COLOUR, name) for name in (".cm-gutters", "header")]
    assert colours[0] == colours[1]  # the theme's, not the editor's
    await page.keyboard.press("Shift+F5")
    await until(page, "!document.querySelector('.cm-line.here')")
    log = "[...document.querySelectorAll('.printed li')].map(line => line.textContent)"
    await shows(page, log, [ENDED, ENDED])
    await page.click("header >> text=中文")
    await shows(page, log, [ENDED, "由用户结束"])  # the program's words are its own
    assert page.errors == []


async def test_message_of_the_checker_can_be_read(studio: Open) -> None:
    page = await studio()
    await opens_text(page, "cyberdog.motion.tunr(20, 1)")
    await page.hover(".cm-lint-marker")  # it stays for long enough
    await page.wait_for_selector(".cm-tooltip >> text=Did you mean 'turn'?")
    assert page.errors == []


async def test_buttons_undo_and_redo_texts(studio: Open) -> None:
    page = await studio()
    await opens_text(page, "n = 1")
    await page.click(".cm-content")
    await page.keyboard.press("Control+End")
    await page.keyboard.press("F9")
    await shows(page, "document.querySelector('.notice').innerText", "Breakpoint set: 1 n = 1")
    await page.keyboard.insert_text("23")  # one change, however slow the machine is
    for name, found in (("Undo", "n = 1"), ("Redo", "n = 123")):
        await page.get_by_role("button", name=name).click()
        await shows(page, "document.querySelector('.cm-content').textContent", found)
    assert page.errors == []


async def test_page_says_that_an_older_version_runs(studio: Open) -> None:
    page = await loaded(await studio(), FOREVER)
    await page.keyboard.press("F5")
    await shows(page, WORD, "Running")
    await until(page, "studio.editor.workspace.getBlockById('count')")
    seconds = "studio.editor.workspace.getBlockById('count').getInputTargetBlock('SECONDS').setFieldValue(%d, 'NUM')"
    await page.evaluate(seconds % 4)
    await shows(page, WORD, "Running · old version")
    await page.reload()
    await until(page, READY.replace("enabled", "disabled"))
    await shows(page, WORD, "Running · old version")
    await page.evaluate(seconds % 3)
    await shows(page, WORD, "Running")
    await page.click("#tab-robot")
    await page.click(".panel .buttons >> text=Stop")  # a program that went on would move the robot again
    await phase(page, "idle")
    await page.evaluate(seconds % 5)
    await until(page, "studio.editor.code.value.includes('sleep(5)')")
    await page.evaluate("studio.say('so far')")
    await page.keyboard.press("F5")
    await shows(page, WORD, "Running")
    await shows(page, "document.querySelector('.notice').textContent", "so far")
    assert page.errors == []


async def test_reload_after_the_end_shows_output_and_error(studio: Open) -> None:
    page = await studio()
    await opens_text(page, "print('hi')\nprint(1 / 0)\n")
    await page.click("#tab-output")
    await page.keyboard.press("F5")
    failed = "document.querySelector('.panel .failure')?.textContent ?? ''"
    await until(page, f"({failed}).includes('divided by zero')")
    await phase(page, "idle")
    await page.reload()
    await until(page, f"window.studio && ({failed}).includes('divided by zero')")
    await prints(page, "hi")
    await shows(page, WORD, "Failed")
    await page.evaluate("import('/studio/program.js').then(p => p.fresh())")
    await shows(page, WORD, "Ready")
    await prints(page)
    assert page.errors == []


async def test_two_tabs_show_one_program(studio: Open) -> None:
    page = await studio()
    await opens_text(page, "print(1)\n")
    other = await studio(page.context)
    written = "document.querySelector('.cm-content')?.innerText.trim()"
    await shows(other, written, "print(1)")
    await other.click(".cm-content")
    await other.keyboard.press("Control+End")
    await other.keyboard.type("print(2)")
    await shows(page, written, "print(1)\nprint(2)")
    await page.evaluate("import('/studio/program.js').then(p => p.fresh())")
    await loaded(page, COUNTING)
    await other.reload()
    await until(other, "window.studio?.editor.workspace?.getBlockById('say')")
    await other.evaluate("studio.editor.toggleBreak('say')")
    await shows(page, "studio.editor.breaks.value.join()", "say")
    assert page.errors == other.errors == []


@pytest.mark.slow  # the same pulse: test_console_link.py; a lost link: test_studio.py
async def test_silent_server_counts_as_lost(studio: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    page = await studio()
    with monkeypatch.context() as patch:
        patch.setattr(Session, "post", lambda *_: None)  # the page's other socket is answered
        await page.evaluate(QUICKLY)
        await shows(page, ONLINE, "lost")
        await page.evaluate("delete performance.now")
    await page.wait_for_selector(".banner.bad")
    await shows(page, ONLINE, "open")
    await page.wait_for_selector(".banner.bad", state="detached")


ENDINGS = {
    "Failed": "studio.runner.failure.value = { text: 'why', line: 0, block: '' }",
    "Not all done": "studio.runner.failure.value = null; studio.runner.refused.value = [{ block: '', words: 'no' }]",
}
CUT = "['.phase', '[role=tablist]'].filter(name => { const e = document.querySelector(name); " \
    "return e.clientWidth && e.scrollWidth > e.clientWidth; })"  # fmt: skip
ON_TOP = """(() => {
    const said = document.querySelector('.notice'), { left, right, top, bottom } = said.getBoundingClientRect();
    said.style.pointerEvents = 'auto';
    const y = (top + bottom) / 2, seen = [left + 2, (left + right) / 2, right - 2].every(
        (x) => said.contains(document.elementFromPoint(x, y)));
    const below = document.querySelector('.switch').getBoundingClientRect();
    return seen && (!below.height || bottom <= below.top);
})()"""


async def test_endings_and_tabs_fit_every_width(studio: Open) -> None:
    page = await studio()
    for ending, made in ENDINGS.items():
        await page.evaluate(made)
        await shows(page, WORD, ending)
        for width in (390, 768, 820, 900, 1024, 1280, 1920):
            await page.set_viewport_size({"width": width, "height": 800})
            assert await page.evaluate(CUT) == [], (ending, width)
            assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth"), width


async def test_notices_cover_toolbox_and_leave_buttons(studio: Open) -> None:
    page = await studio()
    for width in (390, 820, 1280):
        await page.set_viewport_size({"width": width, "height": 800})
        await page.evaluate("studio.say('The dictionary has no such entry, nor any other of that name.', true)")
        await shows(page, ON_TOP, True)


async def test_hint_makes_way_for_the_toolbox(studio: Open) -> None:
    page = await studio()
    assert await page.locator(".start p").is_visible()
    await page.click("#math")
    await page.wait_for_selector(".start p", state="hidden")


@pytest.mark.parametrize("stored", ["fr", "{", "null", "__proto__", "constructor"])
async def test_pages_open_with_any_storage(tabs: Tabs, stored: str) -> None:
    """Another program of this address may have kept other things: pages were blank, or showed keys for words."""
    storage = dict.fromkeys((*KEPT, "studio.program.p", "studio.versions.p"), stored) | {"studio.last": "p"}
    for path, shown in (("/#/toString", "nav"), ("/studio/", "header")):
        page = await tabs.open(path, storage, {"width": 1280, "height": 800})
        await page.wait_for_selector(f"{shown} >> text=/(Class|Stop)/")
        if path == "/studio/":
            await until(page, READY)
            await page.click("#tab-missions")
        assert page.errors == []


async def test_unreadable_blocks_stay_in_the_browser(tabs: Tabs) -> None:
    """The page opened empty without a word; the next change stored that in place of the program."""
    blocks = {"languageVersion": 0, "blocks": [{"type": "of_a_newer_version", "x": 1, "y": 1}]}
    kept = json.dumps({"id": "p", "kind": "blocks", "name": "n", "style": {"blocks": blocks}, "body": "print(1)"})
    storage = {"language": "en", "studio.last": "p", "studio.program.p": kept}
    page = await tabs.open("/studio/", storage, {"width": 1280, "height": 800})
    await until(page, READY)
    await until(page, "document.querySelector('.notice').textContent.includes('cannot be read')")
    opened = "import('/studio/program.js').then(p => { p.changed(); return [p.program.value.kind, p.python()]; })"
    assert await page.evaluate(opened) == ["text", "print(1)"]
    assert await page.evaluate("localStorage.getItem('studio.program.p')") == kept
    assert page.errors == []
