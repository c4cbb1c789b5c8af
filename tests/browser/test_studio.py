"""The studio in Chromium: run, step, break, stop, mend; by keyboard alone; the page killed; text; missions; axe."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from roboglot.model.geometry import Pose
from tests.browser.served import Served, Tabs, becomes, shows, until

pytestmark = pytest.mark.asyncio(loop_scope="session")
AXE = (Path(__file__).parent / "vendor" / "axe.min.js").read_text("utf-8")
PATH = "/studio/"
READY = (  # unless its program already runs
    "window.studio && studio.editor.workspace"
    " && (document.querySelector('.button.main:enabled') || studio.runner.phase.value === 'running')"
)
Page = Any
Open = Callable[..., Awaitable[Page]]

number = {"shadow": {"type": "math_number", "fields": {"NUM": 3}}}
COUNTING = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {
                "type": "variables_set", "id": "set", "x": 30, "y": 30, "fields": {"VAR": {"name": "n"}},
                "inputs": {"VALUE": number},
                "next": {"block": {
                    "type": "controls_repeat_ext", "id": "loop",
                    "inputs": {"TIMES": number, "DO": {"block": {
                        "type": "math_change", "id": "more", "fields": {"VAR": {"name": "n"}},
                        "inputs": {"DELTA": number},
                        "next": {"block": {
                            "type": "text_print", "id": "say",
                            "inputs": {"TEXT": {"block": {"type": "variables_get", "fields": {"VAR": {"name": "n"}}}}},
                        }},
                    }}},
                }},
            }
        ],
    }
}  # fmt: skip
FOREVER = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {"type": "forever", "id": "always", "x": 30, "y": 30, "inputs": {"DO": {"block": {
                "type": "wait", "id": "count", "inputs": {"SECONDS": number}}}}}  # of robot time, which stands still
        ],
    }
}  # fmt: skip


DIRECTIONS = """(() => {
  const { prototype } = CanvasRenderingContext2D, { rotate } = prototype;
  prototype.rotate = function (angle) { this.canvas.turned = -angle; rotate.call(this, angle); };
})()"""  # each picture keeps the direction in which it drew a robot


@pytest_asyncio.fixture(loop_scope="session")
async def studio(opened: Served, tabs: Tabs) -> AsyncIterator[Open]:
    """Open the studio; what a test has running is ended with it."""

    async def opening(context: Any = None, **choices: str) -> Page:
        if context is None:
            storage = {"language": "en", "theme": "light", **choices}
            page = await tabs.open(PATH, storage, {"width": 1400, "height": 900})
        else:
            page = await tabs.add(context)
            await page.goto(f"{tabs.address}{PATH}")
        await until(page, READY)
        return page

    yield opening
    await tabs.close()
    service = next(iter(opened.runtime._programs.values())).service
    await service.shutdown([figures.target_id for figures in service.running()])


async def loaded(page: Page, state: object) -> Page:
    await page.evaluate("state => { studio.editor.load(state); studio.editor.changes.value += 1; }", state)
    return page


async def phase(page: Page, wanted: str) -> None:
    await until(page, f"studio.runner.phase.value === {wanted!r}")


async def prints(page: Page, *lines: str) -> None:
    """Wait until the program has printed these lines, and no others."""
    await shows(page, "studio.runner.printed.value.filter(e => e.level === 'print').map(e => e.text)", [*lines])


async def put_down(page: Page) -> None:
    """Put down the block that the keyboard moves. A key that comes before the editor listens is pressed again."""
    while await page.evaluate("studio.editor.workspace.isDragging()"):
        await page.keyboard.press("Enter")
        for _ in range(40):
            if not await page.evaluate("studio.editor.workspace.isDragging()"):
                break
            await asyncio.sleep(0.05)


async def test_program_halts_at_breakpoint_steps_and_runs_on(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    await page.evaluate("studio.editor.toggleBreak('say')")
    await page.keyboard.press("F5")
    await phase(page, "paused")
    await until(page, "document.querySelector('.lit')?.dataset.id === 'say'")
    await until(page, "studio.runner.variables.value.n === '6'")
    await page.keyboard.press("F8")
    await until(page, "studio.runner.phase.value === 'paused' && studio.runner.lit.value !== 'say'")
    await prints(page, "6")
    await page.evaluate("studio.editor.toggleBreak('say')")
    await page.click("text=Go on")
    await phase(page, "idle")
    await prints(page, "6", "9", "12")
    await page.keyboard.press("Control+s")
    await shows(page, "document.querySelector('.notice').innerText", "Kept on the robot")
    assert page.errors == []


async def test_endless_program_is_stopped_after_a_page_crash(studio: Open) -> None:
    page = await loaded(await studio(), FOREVER)
    await page.click("button.main")
    await until(page, "studio.runner.lit.value !== ''")
    again = await studio(page.context)
    await page.close()
    await until(again, "['running', 'paused'].includes(studio.runner.phase.value) && studio.runner.lit.value")
    assert await again.evaluate("studio.editor.workspace.getAllBlocks(false).length") == 3
    await again.keyboard.press("Shift+F5")
    await phase(again, "idle")
    await becomes(again.locator(".lit").count, 0)
    assert again.errors == []


async def test_error_is_at_its_block_in_both_languages(studio: Open) -> None:
    page = await studio()
    wrong = {"type": "math_arithmetic", "fields": {"OP": "DIVIDE"}, "inputs": {
        "A": number, "B": {"shadow": {"type": "math_number", "fields": {"NUM": 0}}}}}  # fmt: skip
    block = {"type": "text_print", "id": "bad", "x": 30, "y": 30, "inputs": {"TEXT": {"block": wrong}}}
    await loaded(page, {"blocks": {"languageVersion": 0, "blocks": [block]}})
    await page.click("button.main")
    await until(page, "studio.runner.failure.value?.block === 'bad'")
    await shows(page, "studio.runner.failureWords.value", "Something is divided by zero.")
    await page.click("text=中文")
    await shows(page, "studio.runner.failureWords.value", "出现了除以零。")
    await page.click("#tab-output")  # once, with the line as the page counts
    shown = "出现了除以零。 ZeroDivisionError: division by zero (第 1 行: print(3 / 0)) 显示积木"
    await shows(page, "document.querySelector('#panel').innerText.split(/\\n+/).join(' ')", f"输出 {shown}")
    assert await page.evaluate("studio.editor.workspace.getAllBlocks(false).length") == 4  # nothing was lost
    assert page.errors == []


async def test_program_is_built_run_and_debugged_by_keyboard(studio: Open) -> None:
    page = await studio()
    assert "drag a block here" in await page.inner_text(".start")
    for _ in range(30):
        await page.keyboard.press("Tab")
        if await page.evaluate("document.activeElement.classList.contains('blocklyToolboxCategoryContainer')"):
            break
    for _ in range(4):
        await page.keyboard.press("ArrowDown")  # into the text fields
    await shows(page, "document.activeElement.id", "text")
    await page.keyboard.press("ArrowRight")
    await until(page, "document.activeElement.classList.contains('blocklyPath')")
    await page.keyboard.press("Enter")
    await until(page, "studio.editor.workspace.isDragging()")
    await put_down(page)
    await until(page, "studio.editor.code.value.includes('print(') && !document.querySelector('.start')")
    await page.keyboard.press("i")
    await until(page, "document.getElementById('blocklyAriaAnnounce').textContent.includes('print')")
    await page.keyboard.press("F9")
    await until(page, "/^Breakpoint set: print/.test(document.querySelector('.notice').innerText)")
    await page.keyboard.press("F5")
    await phase(page, "paused")
    await prints(page)
    await page.keyboard.press("F8")
    await phase(page, "idle")
    await prints(page, "hello")
    await page.keyboard.press("F9")  # the breakpoint is gone
    await page.evaluate("studio.runner.printed.value = []")
    await page.keyboard.press("F5")
    await prints(page, "hello")
    await phase(page, "idle")
    await page.keyboard.press("Delete")
    await until(page, "studio.editor.isEmpty()")
    await page.keyboard.press("Control+z")
    await until(page, "studio.editor.code.value.includes('print(')")
    await page.keyboard.press("Control+y")
    await until(page, "studio.editor.isEmpty()")


async def test_values_stand_at_their_blocks(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    await page.evaluate("studio.editor.toggleBreak('say')")
    await page.keyboard.press("F5")
    await phase(page, "paused")
    bubble = "document.querySelector('.value-bubble[data-of=more] text')?.textContent"
    await until(page, f"{bubble} === 'n = 6'")
    await page.keyboard.press("F5")
    await phase(page, "paused")
    await until(page, f"{bubble} === 'n = 9'")
    await page.keyboard.press("Shift+F5")
    await phase(page, "idle")
    reads = {"type": "text_print", "id": "see", "x": 30, "y": 30, "inputs": {
        "TEXT": {"block": {"type": "value cyberdog.bms.get_data"}}}}  # fmt: skip
    await loaded(page, {"blocks": {"languageVersion": 0, "blocks": [reads]}})
    await page.keyboard.press("F5")
    await until(page, "document.querySelector('.value-bubble[data-of=see] text')?.textContent")
    assert page.errors == []


async def test_python_opens_as_text_with_the_checkers_words(studio: Open) -> None:
    page = await studio()
    await page.click("text=Programs")
    await page.click("text=New, in Python")
    await page.click(".cm-content")
    await page.keyboard.type("cyberdog.motion.tur")
    await page.wait_for_selector(".cm-tooltip-autocomplete >> text=turn")
    await page.keyboard.press("Escape")
    await until(page, "studio.runner.problems.value[0]?.en.includes(\"Did you mean 'turn'\")")
    await page.wait_for_selector(".cm-lintRange-error")
    assert page.errors == []


@pytest.mark.slow  # long; the console's: test_layout.py
@pytest.mark.parametrize("theme", ["dark", "light"])
async def test_no_serious_finding_of_axe(studio: Open, theme: str) -> None:
    page = await loaded(await studio(theme=theme), COUNTING)
    await page.evaluate(AXE)
    for tab in ("python", "output", "values", "robot", "missions"):
        await page.click(f"#tab-{tab}")
        found = await page.evaluate("axe.run({ resultTypes: ['violations'] })")
        serious = [
            (tab, one["id"], one["nodes"][0]["target"], one["nodes"][0]["failureSummary"][:300])
            for one in found["violations"]
            if one["impact"] in ("serious", "critical")
        ]
        assert serious == []


@pytest.mark.slow  # tests/console has the rehearsal
async def test_the_program_is_simulated_first(studio: Open, opened: Served) -> None:
    page = await loaded(await studio(), COUNTING)
    await page.click("#tab-robot")
    await page.click("text=Simulate first")
    await until(page, "document.querySelector('.failure.fine')")
    assert opened.robot.actions.running() == []
    await prints(page)  # the robot's own log
    assert page.errors == []


async def test_simulated_picture_has_the_frame_of_the_map(studio: Open, opened: Served) -> None:
    world, page = opened.runtime.fleet.world, await studio()
    before = world.truth.pose_of("a")
    world.stage.place("a", Pose(before.x, before.y, before.yaw + 1.5))  # no time passes: it believes what it did
    await page.evaluate(DIRECTIONS)
    await page.click("#tab-robot")
    await until(page, "document.querySelector('.world canvas').turned !== undefined")
    await loaded(page, FOREVER)
    await page.dblclick("text=Simulate first")
    await until(page, "document.querySelector('canvas.trace')?.turned !== undefined")
    shown = await page.evaluate("['.world canvas', 'canvas.trace'].map(c => document.querySelector(c).turned)")
    world.stage.place("a", before)
    await page.locator("canvas.trace").locator("xpath=preceding::button[1]").click()
    await shows(page, "document.querySelector('.notice').innerText", "The simulation has ended.")  # no refusal
    assert shown[1] == pytest.approx(shown[0], abs=0.05)
    assert page.errors == []


async def test_key_pressed_without_link_counts_after_reconnection(studio: Open, browser: Any) -> None:
    context = await browser.new_context(viewport={"width": 1400, "height": 900}, locale="en-US")
    links: list[Any] = []
    broken = asyncio.Event()

    async def route(link: Any) -> None:
        if broken.is_set():
            await link.close()
        else:
            link.connect_to_server()
            links.append(link)

    await context.route_web_socket("**/studio", route)
    page = await loaded(await studio(context), COUNTING)
    await page.evaluate("studio.editor.toggleBreak('more')")
    await page.keyboard.press("F5")
    held = "(studio.runner.phase.value === 'paused' ? document.querySelector('.lit')?.dataset.id : '')"
    await until(page, f"{held} === 'more'")
    broken.set()
    await links[-1].close()
    await page.wait_for_selector(".banner.bad >> text=Your program may still be running;")
    await shows(page, "document.querySelector('.phase').textContent", "State unknown")
    await until(page, "!document.querySelector('.lit')")
    await page.keyboard.press("F8")
    await page.wait_for_selector("text=It will be done as soon as the connection is back.")
    broken.clear()
    await until(page, f"{held} === 'say'")
    await context.close()


async def test_answers_are_shown_in_plain_words(studio: Open) -> None:
    page = await studio()
    done = "(state (code 0, describe success), response (motion_id 304, result True, code 0, order_process_bar 100))"
    words = "import('/studio/bubbles.js').then(m => m.inWords(%s))"
    told = {done: "✓ done", "(state (code 0, describe success))": "✓ done",
            "(state (code 0, describe success), data (range 0.8))": "data (range 0.8)",
            done.replace("True", "False"): done.replace("True", "False")[35:-1],
            "(state (code 7, describe busy))": "(state (code 7, describe busy))", "0.8": "0.8"}  # fmt: skip
    assert {raw: await page.evaluate(words % json.dumps(raw)) for raw in told} == told


@pytest.mark.slow  # long
async def test_page_asks_again_until_a_robot_is_programmable(studio: Open, browser: Any) -> None:
    context = await browser.new_context(locale="en-US")
    asked: list[str] = []

    async def route(link: Any) -> None:
        server = link.connect_to_server()

        def hear(text: str) -> None:
            message = json.loads(text)
            if message["type"] == "open":
                asked.append(message["robot"])
                if len(asked) <= 2:  # as before the robot's programs are ready
                    link.send(json.dumps({"type": "opened", "robot": message["robot"], "error": "it starts"}))
                    return
            server.send(text)

        link.on_message(hear)

    await context.route_web_socket("**/studio", route)
    page = await loaded(await studio(context), COUNTING)
    await page.wait_for_selector("text=This robot cannot be programmed at the moment: it starts")
    await page.keyboard.press("F5")  # kept until the robot is back
    await page.wait_for_selector("text=as soon as the robot can be programmed")
    await until(page, "studio.runner.printed.value.some(e => e.text === '12')")
    await becomes(page.locator(".banner.warn").count, 0)
    assert len(asked) == 3
    await context.close()


@pytest.mark.slow  # long; in short: test_error_is_at_its_block_in_both_languages
async def test_a_change_of_language_and_look_loses_nothing(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    await page.evaluate("studio.editor.toggleBreak('say')")
    await page.keyboard.press("F5")
    held = "studio.runner.phase.value === 'paused' && document.querySelector('.lit')?.dataset.id === 'say'"
    await until(page, held)
    code = await page.evaluate("studio.editor.code.value")
    await page.evaluate(AXE)
    marks = {"contrast": "#000", "dyslexia": "OpenDyslexic"}
    for look in marks:
        await page.select_option(".looks select", look)
        await until(page, f"document.documentElement.dataset.look === {look!r}")
        style = "getComputedStyle(document.body)"
        assert marks[look] in await page.evaluate(f"{style}.fontFamily + {style}.getPropertyValue('--text')")
        label = "getComputedStyle(document.querySelector('.blocklyToolboxCategoryLabel'))"
        assert await page.evaluate(f"{label}.fontFamily === {style}.fontFamily")
        found = await page.evaluate("axe.run({ resultTypes: ['violations'] })")
        assert [v["id"] for v in found["violations"] if v["impact"] in ("serious", "critical")] == []
    await page.click("header >> text=中文")
    await until(page, "document.documentElement.lang === 'zh-CN'")
    await until(page, "document.title === '编程工作室'")
    await until(page, held)
    await shows(page, "[studio.editor.code.value, studio.editor.breaks.value.join()]", [code, "say"])
    await page.keyboard.press("F8")
    await until(page, "studio.runner.printed.value.some(e => e.text === '6')")
    assert {url for url in asked if not url.startswith(page.url.split("/studio/")[0])} == set()  # offline, too
    assert page.errors == []
