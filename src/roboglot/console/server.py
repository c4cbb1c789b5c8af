"""The console's port: bound at once, served as soon as its libraries are loaded, after the doors are open."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import importlib
import logging
import math
import socket
import sqlite3
import time
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from typing import TYPE_CHECKING

from roboglot.config import ConsoleConfig
from roboglot.console.desk import Desk
from roboglot.console.settings import BEAT, BEAT_PAGES, PORTS_TRIED_MAX
from roboglot.extras import MissingExtra, in_words, is_there, open_uvicorn
from roboglot.model.admission import Admission
from roboglot.model.background import load
from roboglot.model.errors import RobotError
from roboglot.protocols.browsers import Browsers
from roboglot.protocols.gate import Gate
from roboglot.transport.listening import end_vanished
from roboglot.transport.tls import Tls

if TYPE_CHECKING:
    from roboglot.console.application import Application
    from roboglot.console.live import Page
    from roboglot.console.people.sessions import Sessions
    from roboglot.console.studio.classroom import Classroom

log = logging.getLogger(__name__)
BACKLOG = 64
UTF8_MAX = 3  # bytes per character
LIBRARIES = ("uvicorn.protocols.http.httptools_impl", "uvicorn.protocols.websockets.wsproto_impl")


class Console:
    """Console of all robots of one program. ``port``: the bound one, 0 while closed."""

    def __init__(self, desk: Desk, config: ConsoleConfig, tls: Tls | None = None) -> None:
        self._desk, self._config, self._tls = desk, config, tls
        self._gate: Gate | None = None
        self.port = 0
        self._socket: socket.socket | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._server: asyncio.Server | None = None
        self._application: Application | None = None
        self._login: asyncio.Task[Sessions] | None = None
        self._connections: AbstractSet[asyncio.BaseProtocol] = set()

    @property
    def address(self) -> str:
        """URL to open in a browser."""
        host = f"[{self._config.address}]" if ":" in self._config.address else self._config.address
        return f"{'https' if self._tls else 'http'}://{host}:{self.port}"

    def open(self) -> None:
        """Bind the port, or the next free one, and get ready in the background. Without a port, only log a warning.

        Raises MissingExtra if metrics are to be pushed and their package is missing.
        """
        if self._config.otlp and not is_there("opentelemetry.proto"):
            raise MissingExtra(in_words("[console] otlp", ["opentelemetry-proto"], "otlp"))
        try:
            self._socket = bound(self._config.address, self._config.port)
        except OSError as error:
            log.warning("cannot open the console: %s", error)
            return
        self.port = self._socket.getsockname()[1]
        for view in self._desk.views.values():
            view.settle()
        self._tasks.append(asyncio.get_running_loop().create_task(self._serve(self._socket), name="console"))

    async def ready(self) -> None:
        """Wait until the console answers."""
        await self._tasks[0]

    async def _serve(self, listening: socket.socket) -> None:
        await load(_load)
        from uvicorn.config import Config
        from uvicorn.server import ServerState

        from roboglot.console.application import Application
        from roboglot.console.page_socket import PageSocket
        from roboglot.console.studio.channel import MESSAGE_MAX as STUDIO_MESSAGE_MAX
        from roboglot.transport.http import BoundedConnection

        browsers = Browsers("[console]", self._config.origins, self._config.hosts, self._desk.first.admission)
        classroom = await asyncio.to_thread(self._build_classroom)
        self._login = asyncio.get_running_loop().create_task(asyncio.to_thread(self._open_sessions), name="sessions")
        login = await asyncio.shield(self._login)  # closed even if this ends before it is open
        self._application = Application(self._desk, browsers, classroom, login, self.address)
        config = Config(
            self._application,
            ws=PageSocket,
            lifespan="off",
            interface="asgi3",
            log_config=None,
            access_log=False,
            proxy_headers=False,
            ws_max_size=STUDIO_MESSAGE_MAX * UTF8_MAX,  # each socket also has its own limit
            ws_per_message_deflate=False,
        )
        config.load()
        state = ServerState()
        self._connections = state.connections
        loop = asyncio.get_running_loop()
        asking = (robot.admission for robot in self._desk.robots.values() if robot.admission.enforced)
        self._gate = Gate(next(asking, Admission()), self._tls)
        gated = self._gate.before(lambda: BoundedConnection(config, state, {}, loop), "console pages")
        self._server = await loop.create_server(gated, sock=listening, backlog=BACKLOG)
        self._tasks.append(loop.create_task(self._beat(self._application), name="console beat"))
        if self._config.otlp:
            self._tasks.append(loop.create_task(self._push(self._application), name="metrics to a collector"))

    def _build_classroom(self) -> Classroom | None:
        from roboglot.console.studio.class_files import ClassFiles
        from roboglot.console.studio.classroom import Classroom

        folder = self._desk.studio.classes
        return Classroom(ClassFiles(folder)) if folder is not None and self._desk.studio.home is None else None

    def _open_sessions(self) -> Sessions:
        """Return the stored sessions; an empty set, with a log line, if they cannot be read."""
        from roboglot.access.session_file import SessionFile
        from roboglot.console.people.sessions import Sessions

        if self._desk.sessions is None:
            return Sessions()
        try:
            file = SessionFile(self._desk.sessions)
            try:
                return Sessions(file)
            except RobotError:
                file.close()
                raise
        except (OSError, ValueError, sqlite3.Error, RobotError) as error:
            log.error("cannot read the sessions, all must sign in again: %s: %s", self._desk.sessions, error)
            return Sessions()

    async def _push(self, application: Application) -> None:
        """Send metrics to the collector."""
        otlp = await load(lambda: importlib.import_module("roboglot.console.otlp"))
        await otlp.Pusher(await application.metrics(), self._config.otlp, self._config.otlp_period).run()

    async def _beat(self, application: Application) -> None:
        """Trigger the pages' updates, many pages in turns; robots are read only while a page is open."""
        number = 0
        while True:
            await asyncio.sleep(BEAT)
            number += 1
            if application.pages:
                for view in self._desk.views.values():
                    if view.watched:
                        view.look(time.monotonic())
                for page in those_due(list(application.pages), number):
                    page.beat(number)

    async def close(self) -> None:
        """Close all pages and the port."""
        for task in self._tasks:
            task.cancel()
        for task in self._tasks:
            with contextlib.suppress(asyncio.CancelledError):
                await task
        for view in self._desk.views.values():
            view.end()
        if self._gate is not None:
            self._gate.close()
        if self._application is not None:
            await self._application.close()
        if self._server is not None:
            self._server.close()
        elif self._socket is not None:
            self._socket.close()
        for connection in list(self._connections):
            if (transport := getattr(connection, "transport", None)) is not None:
                transport.abort()
        await self._close_sessions()  # last: who signs out until now stays signed out
        self.port = 0

    async def _close_sessions(self) -> None:
        if self._login is not None:
            await asyncio.to_thread((await self._login).close)


def those_due(pages: Sequence[Page], number: int) -> list[Page]:
    """Return the pages to update at a beat: at most BEAT_PAGES, in turns, of those that draw a moving robot."""
    drawing = [page for page in pages if page.moving]
    turns = math.ceil(len(drawing) / BEAT_PAGES)
    taken = [page for place, page in enumerate(drawing) if (number + place) % turns == 0]
    return taken + [page for page in pages if not page.moving]


def _load() -> None:
    """Import slow libraries; call it off the loop."""
    open_uvicorn()
    for library in LIBRARIES:
        importlib.import_module(library)


def bound(address: str, first: int) -> socket.socket:
    """Return a socket bound to port ``first`` or the next free one. Raises OSError."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    for port in range(first, first + (PORTS_TRIED_MAX if first else 1)):
        listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)  # asyncio then sets TCP_NODELAY
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((address, min(port, 65_535)))
            end_vanished(listening)  # before the first client, who may come before the pages are served
            listening.listen(BACKLOG)
        except OSError as error:
            listening.close()
            if error.errno != errno.EADDRINUSE:
                raise
        else:
            listening.setblocking(False)
            return listening
    raise OSError(errno.EADDRINUSE, f"ports {first} to {first + PORTS_TRIED_MAX - 1} of {address} are taken")
