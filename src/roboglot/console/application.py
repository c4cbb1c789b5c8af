"""The console as an ASGI application: pages, the interface for scripts, the live socket. Checks the client first."""

from __future__ import annotations

import asyncio
import logging
import time
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, TypeVar, cast

from msgspec import MsgspecError

from roboglot.console.api import Api
from roboglot.console.assets import Assets
from roboglot.console.desk import Desk
from roboglot.console.http import Message, Problem, Receive, Scope, Send, answer, answer_json, session_lasts
from roboglot.console.live import Page
from roboglot.console.people.classes import Classes
from roboglot.console.people.entry import CHALLENGE, address_of, admission_of, enter
from roboglot.console.people.login import Login
from roboglot.console.people.sessions import Sessions
from roboglot.console.program_runs import end_all
from roboglot.console.settings import JOIN_BURST, JOIN_TRIES, MESSAGE_MAX, REVOKED_SECONDS, VIEWERS_MAX
from roboglot.console.studio.channel import MESSAGE_MAX as STUDIO_MESSAGE_MAX
from roboglot.console.studio.channel import Session
from roboglot.console.studio.class_link import Hello, LinkedRoom
from roboglot.console.studio.classroom import Classroom, World
from roboglot.extras import MissingExtra, explaining
from roboglot.model.admission import Right, Unknown
from roboglot.model.background import load
from roboglot.model.client_context import client, identity
from roboglot.protocols.browsers import Browsers, of_rows
from roboglot.protocols.turns import Turns
from roboglot.transport.limiter import Limiter
from roboglot.validation import why_invalid

if TYPE_CHECKING:
    from roboglot.console.metrics import Metrics

log = logging.getLogger(__name__)
P = TypeVar("P", Page, Session)
QUERY_MAX = 500  # bytes passed on to the log-in page
STOPS = ("/stop", "/cancel", "/pause", "/emergency_stop")  # verbs of robots
GOING_AWAY, BAD_DATA, POLICY, TRY_LATER = 1001, 1003, 1008, 1013


class Application:
    """Application of one console. ``pages`` and ``sessions`` (of the studio): the open ones."""

    def __init__(self, desk: Desk, browsers: Browsers, classroom: Classroom | None, login: Sessions, page: str) -> None:
        """``classroom``: this program's own; None: the one at ``desk.studio.home``. ``page``: our address."""
        self._desk, self._browsers = desk, browsers
        self._assets = Assets()
        self.pages: set[Page] = set()
        self.sessions: set[Session] = set()
        self._ending: set[asyncio.Task[None]] = set()  # classes that are ending
        self._classroom = self._enter_classroom(classroom, page)
        self._listening: dict[asyncio.Task[None], str] = {}  # by task: the page's client
        self._login = login
        self._classes = Classes(desk, self._classroom, self._stop, self._listening.values, self._sign_out)
        for left in login.all():
            self._classes.restore(left)
        self._api = Api(desk, self._classes)
        self._codes = Limiter(JOIN_TRIES / 60.0, JOIN_BURST, time.monotonic)
        self._login_page = Login(desk, self._login, self._classes)
        self._leaving = [
            leave
            for robot in desk.robots.values()
            for leave in (
                robot.admission.on_lost(self._close_pages_of),
                robot.admission.on_gained(self._renew_pages_of),
            )
        ]
        self._metrics: Metrics | None = None  # from the first scrape onwards

    async def close(self) -> None:
        """Close the pages' video calls, the link to the classroom and the metrics."""
        for leave in self._leaving:
            leave()
        if isinstance(self._classroom, LinkedRoom):
            await self._classroom.end()
        if self._metrics is not None:
            self._metrics.close()
        await self._api.calls.close()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            await self._serve_http(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._serve_socket(scope, receive, send)

    def _enter_classroom(self, own: Classroom | None, page: str) -> Classroom | LinkedRoom:
        if (home := self._desk.studio.home) is not None:
            return LinkedRoom(home.path, Hello(home.world, page), self._stop, self._end_class)
        room = own or Classroom()
        room.worlds[""] = World("", page, self._stop, self._end_class)
        return room

    def _end_class(self, code: str) -> None:
        task = asyncio.get_running_loop().create_task(self._classes.end(code), name="end of a class")
        self._ending.add(task)
        task.add_done_callback(self._ending.discard)

    async def _stop(self, name: str) -> None:
        """End every program and motion of a robot; the caller is its teacher. Raises RobotError."""
        await end_all(self._desk, name)

    def _refusal(self, scope: Scope, method: str) -> str:
        return self._browsers.refusal(of_rows(scope["headers"], method))

    async def _serve_http(self, scope: Scope, receive: Receive, send: Send) -> None:
        turns = Turns(self._desk.first, address_of(scope))
        await turns.take(lambda: _stops(scope["path"]))
        await turns.count(self._answer_http(scope, receive, send))

    async def _answer_http(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            if why := self._refusal(scope, scope["method"]):
                raise Problem(403, why)
            if await self._login_page.serve(scope, receive, send):
                return
            if scope["path"] != "/metrics" and not scope["path"].startswith("/api/"):
                await self._serve_file(scope, send)  # anyone may load the pages: they contain no data
                return
            named = await enter(self._desk, self._login, scope)
            if scope["path"] == "/metrics":
                await self._serve_metrics(scope, send)
            elif scope["path"] == "/api/me":
                await answer_json(send, {"name": named, "asks": admission_of(self._desk) is not None})
            else:
                await self._api.serve(scope, partial(self._receive, scope, receive), send, client())
        except Unknown as unknown:
            await answer_json(send, {"error": str(unknown)}, 401, [CHALLENGE])
        except Problem as problem:
            await answer_json(send, {"error": problem.why}, problem.status)

    async def _receive(self, scope: Scope, receive: Receive) -> Message:
        """Return the next message of a client; raises Unknown if its proof was replaced while it sent a body."""
        message = await receive()
        if message["type"] == "http.request":
            await enter(self._desk, self._login, scope)
        return message

    async def _serve_metrics(self, scope: Scope, send: Send) -> None:
        if scope["method"] not in ("GET", "HEAD"):
            raise Problem(405, "metrics accept GET only")
        for robot in self._desk.robots.values():
            if not robot.admission.may(Right.SEE):
                raise Problem(403, "metrics need the right to see every robot")
        try:
            metrics = await self.metrics()
        except MissingExtra as missing:
            raise Problem(501, str(missing)) from None
        await answer(send, 200, metrics.content_type, metrics.text(), [(b"cache-control", b"no-store")])

    async def metrics(self) -> Metrics:
        """Return the metrics, which count from the first call on. Raises MissingExtra."""
        if self._metrics is None:
            with explaining("/metrics", "console"):
                module = await load(lambda: import_module("roboglot.console.metrics"))
            self._metrics = self._metrics or cast("Metrics", module.Metrics(self._desk))
        return self._metrics

    async def _serve_file(self, scope: Scope, send: Send) -> None:
        if scope["path"] in ("/studio", "/studio/") and not await self._knows(scope):
            asked = scope["query_string"][:QUERY_MAX]  # the code of a class and a name, from another world's page
            await answer(send, 303, b"text/plain", b"", [(b"location", b"/?to=studio" + (asked and b"&" + asked))])
            return
        asset = self._assets.find(scope["path"])
        if asset is None:
            raise Problem(404, "there is no such page")
        if scope["method"] not in ("GET", "HEAD"):
            raise Problem(405, "pages accept GET only")
        headers = dict(scope["headers"])
        more = [
            (b"etag", asset.tag.encode()),
            (b"cache-control", b"no-cache"),
            (b"vary", b"accept-encoding"),
            (b"content-security-policy", self._assets.policy),
        ]
        if headers.get(b"if-none-match") == asset.tag.encode():
            await answer(send, 304, asset.content_type.encode(), b"", more)
            return
        body = asset.plain
        if b"gzip" in headers.get(b"accept-encoding", b""):
            body, more = asset.packed, [*more, (b"content-encoding", b"gzip")]
        await answer(send, 200, asset.content_type.encode(), body, more)

    async def _knows(self, scope: Scope) -> bool:
        """Return whether the client is admitted; if not, the log-in page is shown first."""
        try:
            await enter(self._desk, self._login, scope)
        except Unknown:
            return False
        return True

    async def _serve_socket(self, scope: Scope, receive: Receive, send: Send) -> None:
        await receive()  # websocket.connect
        try:
            if scope["path"] not in ("/live", "/studio") or self._refusal(scope, "GET"):
                raise Unknown("the page is from another host")
            named = await enter(self._desk, self._login, scope)
        except Unknown:
            await send({"type": "websocket.close", "code": GOING_AWAY})
            return
        if len(self.sessions if scope["path"] == "/studio" else self.pages) >= VIEWERS_MAX:
            await send({"type": "websocket.accept"})
            await send({"type": "websocket.close", "code": TRY_LATER, "reason": f"{VIEWERS_MAX} pages are open"})
            return
        await send({"type": "websocket.accept"})
        if scope["path"] == "/studio":
            session = Session(self._desk, self._classroom, lambda data: _pass(send, data), self._codes)
            await self._talk(session, self.sessions, STUDIO_MESSAGE_MAX, receive, send)
        else:
            page = Page(self._desk, lambda data: _pass(send, data), named)
            await self._talk(page, self.pages, MESSAGE_MAX, receive, send)

    async def _talk(self, page: P, pages: set[P], longest: int, receive: Receive, send: Send) -> None:
        """Serve a page, listed in ``pages`` while its socket is open; ``longest``: bytes of a message."""
        pages.add(page)
        sending = asyncio.get_running_loop().create_task(page.run(), name="console page")
        listening = asyncio.get_running_loop().create_task(_listen(page, longest, receive), name="console requests")
        self._listening[listening] = identity()
        _end_with_session(listening)
        try:
            await listening
        except asyncio.CancelledError:
            if not listening.cancelled():
                listening.cancel()
                raise
            await send({"type": "websocket.close", "code": POLICY, "reason": "your rights have changed"})
        except (ValueError, MsgspecError, RecursionError) as error:
            why = why_invalid(error, "the message")
            log.info("closed a page of %s: %s", client(), why)
            await send({"type": "websocket.close", "code": BAD_DATA, "reason": why[:100]})
        finally:
            del self._listening[listening]
            pages.discard(page)
            page.close()
            sending.cancel()

    async def _sign_out(self, who: str) -> None:
        await self._login.end_all_of(who)
        self._close_pages_of(who)

    def _renew_pages_of(self, who: str) -> None:
        for page in self.pages:
            if page.person == who:
                page.resend_all()

    def _close_pages_of(self, who: str) -> None:
        for listening in [task for task, owner in self._listening.items() if owner == who]:
            listening.cancel()


def _stops(path: str) -> bool:
    return path.startswith("/api/robots/") and path.endswith(STOPS)


def _end_with_session(listening: asyncio.Task[None]) -> None:
    """Cancel the task once the client has signed out, here or on another page; runs in the client's context."""
    if not session_lasts.get()():
        listening.cancel()
    elif not listening.done():
        asyncio.get_running_loop().call_later(REVOKED_SECONDS, _end_with_session, listening)


async def _listen(page: Page | Session, longest: int, receive: Receive) -> None:
    while (message := await receive())["type"] == "websocket.receive":
        text = message.get("text") or message.get("bytes") or b""
        if len(text) > longest:
            raise ValueError("a message is too long")
        page.receive(text)


async def _pass(send: Send, data: str | bytes) -> None:
    key = "text" if isinstance(data, str) else "bytes"
    await send({"type": "websocket.send", key: data})
