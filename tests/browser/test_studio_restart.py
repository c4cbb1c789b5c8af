"""The server is killed: the page comes back to the program held at its block; it opens and edits without a server."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from roboglot.testing.addresses import free_addresses, free_port, give_back
from tests.browser.served import shows, until
from tests.browser.test_studio import READY

pytestmark = pytest.mark.asyncio(loop_scope="session")
HALTED = {
    "blocks": {
        "languageVersion": 0,
        "blocks": [
            {
                "type": "variables_set", "id": "set", "x": 30, "y": 30, "fields": {"VAR": {"name": "n"}},
                "inputs": {"VALUE": {"shadow": {"type": "math_number", "fields": {"NUM": 7}}}},
                "next": {"block": {
                    "type": "text_print", "id": "say", "data": "breakpoint",
                    "inputs": {"TEXT": {"block": {"type": "variables_get", "fields": {"VAR": {"name": "n"}}}}},
                    "next": {"block": {
                        "type": "text_print", "id": "end",
                        "inputs": {"TEXT": {"shadow": {"type": "text", "fields": {"TEXT": "end"}}}},
                    }},
                }},
            }
        ],
    }
}  # fmt: skip
HELD = "(studio.runner.phase.value === 'paused' ? document.querySelector('.lit')?.dataset.id : '')"
Life = Callable[[], Awaitable[asyncio.subprocess.Process]]


@pytest_asyncio.fixture(loop_scope="session")
async def server(tmp_path: Path) -> AsyncIterator[tuple[str, Life]]:
    """Yield the address of a separate server, and what starts it; the last life is ended with the test."""
    address, port, lives = free_addresses(1), free_port(), []
    settings = tmp_path / "settings.toml"
    settings.write_text(
        f'data = "{tmp_path / "data"}"\nworld = "empty"\n[console]\naddress = "{address}"\nport = {port}\n'
        f'[[robots]]\nname = "a"\nbody = "cyberdog2"\naddress = "{address}"\n'
    )

    async def start() -> asyncio.subprocess.Process:
        life = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "roboglot", "up", "--config", str(settings),
            stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.DEVNULL,
            env={**os.environ, "ROBOGLOT_TESTS_COLD": "1"},  # down for as long as a real restart takes
        )  # fmt: skip
        lives.append(life)
        for _ in range(1200):
            try:
                _, writer = await asyncio.open_connection(address, port)
            except OSError:
                assert life.returncode is None, f"the server ended with {life.returncode}"
                await asyncio.sleep(0.05)
            else:
                writer.close()
                return life
        raise TimeoutError("the server did not start")

    yield f"http://{address}:{port}", start
    for life in lives:
        if life.returncode is None:
            life.kill()
        await life.wait()
    give_back([address])


@pytest.mark.slow  # starts a server cold, twice; tests/protocols/visual/test_killed_runs.py
async def test_a_killed_server_gives_the_program_back(server: tuple[str, Life], browser: Any) -> None:
    url, start = server
    first = await start()
    context = await browser.new_context()
    page = await context.new_page()
    await page.goto(f"{url}/studio/")
    await until(page, READY)
    await page.evaluate("state => { studio.editor.load(state); studio.editor.changes.value += 1; }", HALTED)
    await until(page, "studio.editor.code.value.includes('end')")
    await page.keyboard.press("F5")
    await until(page, f"{HELD} === 'say'")
    first.kill()
    await first.wait()
    await until(page, "document.querySelector('.banner.bad')")
    await start()
    await until(page, "!document.querySelector('.banner.bad')")  # meanwhile it shows the old state
    await until(page, f"{HELD} === 'say'")
    second = await context.new_page()  # another tab sees the same
    await second.goto(f"{url}/studio/")
    await until(second, f"window.studio && {HELD} === 'say'")
    await page.bring_to_front()
    await page.keyboard.press("F8")
    await until(page, f"{HELD} === 'end'")
    await until(second, "studio.runner.lit.value === 'end'")
    await page.keyboard.press("F5")
    await until(page, "studio.runner.phase.value === 'idle'")
    texts = "studio.runner.printed.value.filter(e => e.level === 'print').map(e => e.text).join()"
    await shows(page, texts, "7,end")
    await context.close()


@pytest.mark.slow  # long; test_key_pressed_without_link_counts_after_reconnection is near
async def test_pages_open_and_keep_programs_without_the_server(server: tuple[str, Life], browser: Any) -> None:
    url, start = server
    first = await start()
    context = await browser.new_context()
    page = await context.new_page()
    await page.goto(f"{url}/studio/")
    await until(page, READY)
    await page.evaluate("navigator.serviceWorker.ready.then(() => undefined)")
    first.kill()
    await first.wait()
    await page.reload()
    await until(page, "window.studio && studio.editor.workspace && document.querySelector('.banner.bad')")
    await page.evaluate("language => { localStorage.language = language; }", "zh")
    await page.evaluate("state => { studio.editor.load(state); studio.editor.changes.value += 1; }", HALTED)
    await until(page, "studio.editor.code.value.includes('end')")
    await page.reload()
    await until(page, "window.studio?.editor.workspace?.getBlockById('end')")
    await shows(page, "document.documentElement.lang", "zh-CN")
    await start()
    await until(page, "!document.querySelector('.banner.bad')")
    other = await (await browser.new_context()).new_page()  # another device holds it
    await other.goto(f"{url}/studio/")
    await until(other, READY)
    await until(page, "studio.program.value.id && document.querySelector('.stored').textContent.includes('机器人')")
    await other.click("text=Programs")
    await other.wait_for_selector("dialog li >> text=Open")
    await other.context.close()
    await context.close()
