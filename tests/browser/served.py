"""Robot of these tests, and the hosts whose pages a browser shows there."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, cast

from roboglot.console.application import Application
from roboglot.console.http import Message, Scope, Send
from roboglot.console.server import Console
from roboglot.console.teleop import PAD
from roboglot.model.action import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

with contextlib.suppress(ImportError):  # without it, these tests are skipped
    from playwright import async_api

ADDRESS = free_addresses(1)
PATIENCE = 60.0  # s of the machine's time
PAGE_PATIENCE = 60_000  # ms of the machine's time until a page shows a change
STILL = {"reduced_motion": "reduce"}  # no colour is seen halfway to another
NO_WORKER = {"service_workers": "block"}  # 2 s after the start it loads all again; test_studio_restart.py has it
STRANGER, FRIEND, REBOUND = "evil.example", "studio.example", "rebound.example"


Page = Any
OpenConsole = Callable[..., Awaitable[Page]]


@dataclass(frozen=True, slots=True)
class Served:
    """A robot with all its doors open, and the clock that it runs on."""

    robot: Robot
    clock: LockstepClock
    runtime: Runtime


async def becomes(read: Callable[[], Awaitable[object]], wanted: object) -> None:
    """Wait until ``read`` returns what is wanted: a page shows a change when it comes to it."""
    end = time.monotonic() + PATIENCE
    while (found := await read()) != wanted:
        if time.monotonic() > end:
            assert found == wanted
        await asyncio.sleep(0.05)


async def shows(page: Page, expression: str, wanted: object) -> None:
    """Wait until an expression has this value in a page."""
    await becomes(lambda: page.evaluate(expression), wanted)


def is_driven(robot: Robot) -> bool:
    """Return True while something moves the robot, or is to."""
    return any(action.status is ActionStatus.EXECUTING for action in robot.actions.running())


async def drive_until(robot: Robot, clock: LockstepClock, enough: Callable[[], bool]) -> None:
    """Let time pass while a page's pad drives: a piece for each of its commands, shorter than these last."""
    commanded = asyncio.Event()
    deafen = robot.inputs.listen(lambda given: commanded.set() if (given.kind, given.name) == (PAD, "move") else None)
    try:
        async with asyncio.timeout(PATIENCE):
            while not enough():
                commanded.clear()
                await commanded.wait()
                await clock.advance(0.08)
    finally:
        deafen()


async def until(page: Page, expression: str) -> None:
    """Wait until an expression holds; Playwright's own way needs eval, which the page's policy forbids."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if await page.evaluate(f"Boolean({expression})"):
            return
        await asyncio.sleep(0.05)
    raise AssertionError(expression)


def keep_modules(console: Console) -> None:
    """Let browsers keep scripts, styles and words for the whole run: else a page asks for some forty of them again.

    That took a quarter of a page's work. A restarted server's new modules are in test_studio_restart.py.
    """
    application = cast(Application, console._application)
    serve = application._serve_file

    async def serve_for_long(scope: Scope, send: Send) -> None:
        async def send_for_long(message: Message) -> None:
            headers = dict(message.get("headers", ()))
            if b"cache-control" in headers and b"html" not in headers[b"content-type"]:
                message = {**message, "headers": [*(headers | {b"cache-control": b"max-age=3600"}).items()]}
            await send(message)

        await serve(scope, send_for_long)

    application._serve_file = serve_for_long  # type: ignore[method-assign]


class Tabs:
    """Pages of the console and the studio, each for one test at a time.

    One of them is kept for the next test, empty: its process has compiled the page's modules already, which halves the
    work of opening it. A page that a test did more to than use it is closed, and so are all others.
    """

    def __init__(self, browser: Any, address: str) -> None:
        self.address, self._browser = address, browser
        self._empty = f"{address}/studio/vendor/media/sprites.svg"  # of the same server, without a script
        self._kept: Page | None = None
        self._new: tuple[object, ...] = ()
        self._lent: list[Page] = []

    async def open(self, path: str, storage: dict[str, str], viewport: dict[str, int], **options: Any) -> Page:
        """Return a page at ``path``, with this local storage; its ``errors`` are what it complains of.

        ``options`` are a new context's; with any, the page is the test's own.
        """
        kept = not options and not self._lent
        page = self._kept if kept else None
        if page is None:
            context = await self._browser.new_context(**(STILL | NO_WORKER | options))
            page = await self.add(context)
            await page.goto(self._empty)
            if kept:
                self._kept, self._new = page, _handling(page)
                page.add_init_script = context.add_init_script = None  # it cannot be taken back
        self._lent.append(page)
        await page.set_viewport_size(viewport)
        await page.evaluate("kept => Object.assign(localStorage, kept)", storage)
        page.errors.clear()
        await page.goto(f"{self.address}{path}")
        return page

    async def add(self, context: Any) -> Page:
        """Return a further page of a context, which ends with that."""
        page = await context.new_page()
        page.set_default_timeout(PAGE_PATIENCE)
        page.errors = []
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.on("console", lambda said: page.errors.append(said.text) if said.type == "error" else None)
        return page

    async def close(self) -> list[str]:
        """Take back what was lent; return what the pages complained of."""
        said = [line for page in self._lent for line in page.errors]
        for page in self._lent:
            if page is self._kept and await self._emptied(page):
                continue
            self._kept = None if page is self._kept else self._kept
            await page.context.close()
        self._lent.clear()
        return said

    async def _emptied(self, page: Page) -> bool:
        """Leave a page as a new one is; return False if that cannot be."""
        if page.is_closed() or page.context.pages != [page] or _handling(page) != self._new:
            return False
        try:
            await page.goto(self._empty)
            await page.mouse.up()
            await page.mouse.move(0, 0)
            await page.context.clear_cookies()
            await page.evaluate("localStorage.clear(), sessionStorage.clear()")
        except async_api.Error:  # as of one that is offline
            return False
        return True


def _handling(page: Page) -> tuple[object, ...]:
    """Return who handles a page's events and requests, to compare."""
    inside, context = page._impl_obj, page.context._impl_obj
    routes = [*inside._routes, *inside._web_socket_routes, *context._routes, *context._web_socket_routes]
    return routes, {name: len(all_) if isinstance(all_, list) else 1 for name, all_ in inside._events.items()}
