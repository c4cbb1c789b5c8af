"""A real Chromium, a robot in lockstep behind its default ports, and a web site of strangers."""

from __future__ import annotations

import os
import re
import shutil
import threading
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from roboglot.config import RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.visual.config import VisualConfig
from roboglot.runtime import Runtime
from tests.browser.served import ADDRESS, FRIEND, REBOUND, STRANGER, OpenConsole, Page, Served, Tabs, keep_modules

# The shell is the same engine without a browser's own windows, which take as much of the processor as the pages.
KINDS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, KINDS)), None)
OPTIONS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
SITE = b"<!doctype html><meta charset=utf-8><title>a page</title><p>hello</p>"

try:
    from playwright import async_api
except ImportError:
    async_api = None  # type: ignore[assignment]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is in this folder; skip it where there is no browser."""
    here = f"{Path(__file__).parent}{os.sep}"
    for item in items:
        if str(item.path).startswith(here):
            item.add_marker(pytest.mark.browser)
            if async_api is None:
                item.add_marker(pytest.mark.skip(reason="no playwright in this environment (scripts/test brings it)"))
            elif CHROMIUM is None:
                item.add_marker(
                    pytest.mark.skip(reason="no chromium here (Debian: apt-get install chromium-headless-shell)")
                )


class _Page(BaseHTTPRequestHandler):
    """The same page at every path."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("content-type", "text/html")
        self.send_header("content-length", str(len(SITE)))
        self.end_headers()
        self.wfile.write(SITE)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="session")
def site() -> Iterator[int]:
    """The port of a web server of pages that are not the robot's."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Page)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield server.server_port
    server.shutdown()
    server.server_close()


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def opened(tmp_path_factory: pytest.TempPathFactory, site: int) -> AsyncIterator[Served]:
    """A robot of the runtime, as ``roboglot up`` starts it; one origin is let in."""
    data = tmp_path_factory.mktemp("browser")
    friend = (f"http://{FRIEND}:{site}",)
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    config = replace(
        base,
        robots=(RobotConfig("a", "universal", ADDRESS),),
        doors={"slamware": SlamwareConfig(origins=friend), "visual": VisualConfig(origins=friend)},
    )
    runtime = Runtime(config)
    assert isinstance(runtime.clock, LockstepClock)
    await runtime.start()
    yield Served(runtime.fleet.robots["a"], runtime.clock, runtime)
    await runtime.close()


@pytest_asyncio.fixture(loop_scope="session")
async def served(opened: Served) -> AsyncIterator[Served]:
    """The robot; what a test had it do is over when the test ends."""
    yield opened
    for action in opened.robot.actions.running():
        action.cancel("the test is over")
    await opened.clock.advance(2.0)


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def browser(site: int) -> AsyncIterator[async_api.Browser]:
    """Chromium; the names of other hosts lead to this machine, one of them to the robot's own address."""
    rules = f"MAP {REBOUND} {ADDRESS}, MAP {STRANGER} 127.0.0.1, MAP {FRIEND} 127.0.0.1"
    async with async_api.async_playwright() as playwright:
        opened = await playwright.chromium.launch(
            executable_path=CHROMIUM, args=[*OPTIONS, f"--host-resolver-rules={rules}"]
        )
        yield opened
        await opened.close()


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def all_tabs(browser: Any, opened: Served) -> Tabs:
    """Pages of this robot's console."""
    assert opened.runtime.console is not None
    await opened.runtime.console.ready()
    keep_modules(opened.runtime.console)
    return Tabs(browser, opened.runtime.console.address)


@pytest_asyncio.fixture(loop_scope="session")
async def tabs(all_tabs: Tabs) -> AsyncIterator[Tabs]:
    """Pages for a test: the next one finds nothing of them."""
    yield all_tabs
    await all_tabs.close()


@pytest_asyncio.fixture(loop_scope="session")
async def open_console(tabs: Tabs, served: Served) -> AsyncIterator[OpenConsole]:
    """Open the console as someone, in a browser of their own; it must say nothing bad on its own console."""

    async def open_it(person: str = "anna", view: str = "live", language: str = "en", **options: Any) -> Page:
        viewport = options.pop("viewport", {"width": 1280, "height": 800})
        page = await tabs.open(f"/#/{view}", {"person": person, "language": language}, viewport, **options)
        await page.wait_for_selector("nav")
        return page

    yield open_it
    said = await tabs.close()
    assert [line for line in said if not re.search("ERR_(CONNECTION|INTERNET)", line)] == []
