"""Calls that the robot could not do, in Chromium: at their blocks, in the output, and at the end of the run."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose
from tests.browser.served import Served, Tabs, becomes, is_driven, shows, until
from tests.browser.test_studio import READY, Open, loaded, phase, prints, studio

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")
SPEED = {"shadow": {"type": "math_number", "fields": {"NUM": 5}}}
SAID = {"shadow": {"type": "text", "fields": {"TEXT": "on"}}}
TOO_FAST = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {
                "type": "cyberdog.motion.go_straight", "id": "fast", "x": 30, "y": 30, "inputs": {"x_velocity": SPEED},
                "next": {"block": {"type": "text_print", "id": "say", "inputs": {"TEXT": SAID}}},
            }
        ],
    }
}  # fmt: skip
WALK = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [{"type": "cyberdog.motion.go_straight", "id": "walk", "x": 30, "y": 30, "inputs": {
            "x_velocity": {"shadow": {"type": "math_number", "fields": {"NUM": 0.3}}},
            "duration": {"shadow": {"type": "math_number", "fields": {"NUM": 9}}}}}],
    }
}  # fmt: skip
STOPPED = {
    "shadow": {"type": "text", "fields": {"TEXT": "no number"}},
    "block": {"type": "math_arithmetic", "id": "wrong", "fields": {"OP": "DIVIDE"}, "inputs": {
        "A": {"shadow": {"type": "math_number", "fields": {"NUM": 1}}},
        "B": {"shadow": {"type": "math_number", "fields": {"NUM": 0}}}}},
}  # fmt: skip
WORD, WHY = "document.querySelector('.phase').textContent", "x_velocity = 5 is outside of -1.6 to 1.6 m/s"


async def test_run_ends_with_what_was_refused(studio: Open) -> None:
    page = await loaded(await studio(), TOO_FAST)
    await page.click("#tab-output")
    await page.keyboard.press("F5")
    await shows(page, WORD, "Not all done")
    await prints(page, "on")
    shown = "document.querySelector('.panel .failure')?.textContent ?? ''"
    await shows(page, shown, f"The robot could not do this:motion.go_straight (line 1): {WHY}")
    await until(page, "document.querySelector('.wrong')?.dataset.id === 'fast'")
    await shows(page, "document.querySelector('.value-bubble[data-of=fast] text')?.textContent", WHY[:39] + "…")
    await page.click("header >> text=中文")
    zh = "x_velocity = 5 超出 -1.6 到 1.6 m/s"
    await shows(page, "document.querySelector('.value-bubble[data-of=fast] text')?.textContent", zh)
    await page.reload()  # the page is another, the run is the same
    await until(page, READY)
    await shows(page, WORD, "没能全部做到")
    await page.wait_for_selector(f".panel .failure[role=status] >> text={zh}")
    await until(page, "document.querySelector('.wrong')?.dataset.id === 'fast'")
    assert page.errors == []


async def test_refusal_is_gone_with_the_next_run(studio: Open) -> None:
    page = await loaded(await studio(), TOO_FAST)
    await page.keyboard.press("F5")
    await until(page, "document.querySelector('.notice.bad')?.textContent.includes('outside')")
    await phase(page, "idle")
    await page.evaluate("studio.editor.workspace.getBlockById('fast').dispose(true)")
    await until(page, "!studio.editor.code.value.includes('go_straight')")
    await page.keyboard.press("F5")
    await shows(page, WORD, "Ended")
    await until(page, "!document.querySelector('.notice.bad') && !document.querySelector('.wrong')")
    await prints(page, "on")
    assert page.errors == []


async def test_walk_that_a_person_stops_is_no_refusal(studio: Open) -> None:
    page = await loaded(await studio(), WALK)
    await page.click("#tab-output")
    await page.keyboard.press("F5")
    await until(page, "document.querySelector('.lit')?.dataset.id === 'walk'")  # time stands still: it does not arrive
    await page.keyboard.press("Shift+F5")
    await shows(page, WORD, "Ended")
    await page.reload()
    await until(page, READY)
    await shows(page, WORD, "Ended")
    await shows(page, "document.querySelector('#panel').innerText.trim()", "Output\nended by the user")
    assert page.errors == []


@pytest.mark.slow  # in short: test_walk_that_a_person_stops_is_no_refusal
async def test_walk_stopped_before_its_program_is_no_refusal(studio: Open, served: Served) -> None:
    """The robot stands, and has said why, before a busy machine has ended the program."""
    service = next(iter(served.runtime._programs.values())).service
    page = await loaded(await studio(), WALK)
    await page.click("#tab-output")
    await page.keyboard.press("F5")
    await until(page, "document.querySelector('.lit')?.dataset.id === 'walk'")
    await served.clock.advance(1.0)
    async with service._turns.take():
        await page.keyboard.press("Escape")
        await becomes(lambda: asyncio.sleep(0, is_driven(served.robot)), False)
        await served.clock.advance(1.0)
    await shows(page, WORD, "Ended")
    await page.reload()
    await until(page, READY)
    await shows(page, WORD, "Ended")
    await shows(page, "document.querySelector('#panel').innerText.trim()", "Output\nended by the user")


async def test_escape_stops_the_robot_without_a_program(studio: Open, served: Served) -> None:
    page = await studio()
    served.robot[Driving].move_by(Pose(1.0, 0.0, 0.0), source="another client")
    await served.clock.advance(0.5)
    await until(page, "studio.runner.phase.value === 'idle' && document.querySelector('header .stop')")
    await page.keyboard.press("Escape")  # whether or not the page knows already that the robot moves
    await becomes(lambda: asyncio.sleep(0, is_driven(served.robot)), False)
    await served.clock.advance(1.0)
    assert served.robot.actions.running() == []
    assert await page.locator(".notice.bad").count() == 0
    assert page.errors == []


@pytest.mark.parametrize("path", ["/#/live", "/studio/"])
async def test_escape_before_the_first_greeting_stops(served: Served, tabs: Tabs, browser: Any, path: str) -> None:
    context, held = await browser.new_context(), list[Any]()

    async def route(link: Any) -> None:
        link.connect_to_server().on_message(lambda said: held.append(lambda: link.send(said)))

    await context.route_web_socket("**/live", route)
    page = await tabs.add(context)
    await page.goto(f"{tabs.address}{path}")
    await page.wait_for_selector("header")
    await page.evaluate("new Promise(shown => requestAnimationFrame(() => setTimeout(shown)))")  # then it hears keys
    served.robot[Driving].move_by(Pose(1.0, 0.0, 0.0), source="another client")
    await served.clock.advance(0.5)
    await becomes(lambda: asyncio.sleep(0, bool(held)), True)
    await page.keyboard.press("Escape")
    assert is_driven(served.robot)
    for say in held:
        say()
    await becomes(lambda: asyncio.sleep(0, is_driven(served.robot)), False)
    await served.clock.advance(1.0)
    assert page.errors == []
    await context.close()


async def test_error_leaves_what_was_refused_before_it(studio: Open) -> None:
    both = json.loads(json.dumps(TOO_FAST))
    both["blocks"]["blocks"][0]["next"]["block"]["inputs"]["TEXT"] = STOPPED
    page = await loaded(await studio(), both)
    await page.click("#tab-output")
    await page.keyboard.press("F5")
    await shows(page, WORD, "Failed")
    refused = f"The robot could not do this:motion.go_straight (line 1): {WHY}"
    await shows(page, "document.querySelector('.panel .failure[role=status]')?.textContent ?? ''", refused)
    await page.wait_for_selector(".panel .failure[role=group] >> text=/ZeroDivisionError: .* .line 2: /")
    await shows(page, "[...document.querySelectorAll('.wrong')].map((one) => one.dataset.id)", ["fast", "say"])
    assert page.errors == []


async def test_verdict_of_a_mission_shows_refusals(studio: Open) -> None:
    page = await studio()
    await page.click("#tab-missions")
    await page.click(".missions li:first-child button")
    call = {"function": "cyberdog.motion.turn", "line": 3, "module": "m", "block": "", "words": "too fast"}
    graded = {"grade": {"stars": 0, "rows": []}, "refused": [call], "line": 2, "body": "cyberdog.task.block('a')\nx\n"}
    await page.evaluate("found => import('/studio/missions.js').then(m => { m.outcome.value = found; })", graded)
    await page.wait_for_selector(".panel .failure >> text=motion.turn (m, line 3): too fast")
    await page.wait_for_selector(".panel .failure small >> text=line 1")  # of the error
    await page.keyboard.press("F5")  # has the robot walk, not the mission's
    await page.wait_for_selector(".notice >> text=press Try it under Missions")
    assert page.errors == []
