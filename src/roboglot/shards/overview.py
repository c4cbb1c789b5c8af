"""The page of all worlds of a fleet: robots by world, and their states; details are on each world's console.

It is read-only, listens on loopback only, and polls a world's console for the robots on a page's screen.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
import socket
from collections.abc import Set as AbstractSet
from urllib.parse import parse_qs, unquote

from roboglot.agents.console import Refused
from roboglot.config import is_loopback
from roboglot.console.assets import Assets
from roboglot.console.http import Problem, Receive, Scope, Send, answer, answer_json
from roboglot.console.server import LIBRARIES, bound
from roboglot.model.admission import Admission
from roboglot.model.background import load
from roboglot.protocols.browsers import Browsers, of_rows
from roboglot.shards.fleet_host import FleetHost
from roboglot.shards.snapshots import Snapshots
from roboglot.shards.states import Shard

log = logging.getLogger(__name__)
PORT = 50070  # or the next free one
PAGE = "/fleet/"
SEEN_MAX = 100  # robots on the screen of one page
BACKLOG = 64


class Overview:
    """Serves the page at ``address``: a URL, empty while it is closed."""

    def __init__(self, fleet_host: FleetHost, host: str, port: int = PORT) -> None:
        self._fleet_host, self._host, self._port = fleet_host, host, port
        self._snapshots, self._assets = Snapshots(fleet_host), Assets()
        self._browsers = Browsers("", admission=Admission())  # for this machine alone
        self._server: asyncio.Server | None = None
        self._socket: socket.socket | None = None
        self._serving: asyncio.Task[None] | None = None
        self._connections: AbstractSet[asyncio.BaseProtocol] = set()

    @property
    def address(self) -> str:
        """URL of the page; empty if there is none."""
        return f"http://{self._host}:{self._socket.getsockname()[1]}{PAGE}" if self._socket is not None else ""

    def open(self) -> None:
        """Bind the port and get ready in the background; outside loopback, or without a free port, no page opens."""
        if not is_loopback(self._host):
            return
        try:
            self._socket = bound(self._host, self._port)
        except OSError as error:
            log.warning("cannot open the page of all worlds: %s", error)
            return
        self._serving = asyncio.get_running_loop().create_task(self._serve(self._socket), name="page of all worlds")

    async def close(self) -> None:
        """Close the port, and hang up on the pages."""
        if self._serving is not None:
            self._serving.cancel()
            await asyncio.gather(self._serving, return_exceptions=True)
        if self._server is not None:
            self._server.close()
        elif self._socket is not None:
            self._socket.close()
        self._socket = None
        for connection in list(self._connections):
            if (transport := getattr(connection, "transport", None)) is not None:
                transport.abort()

    async def ready(self) -> None:
        """Wait until the page answers."""
        if self._serving is not None:
            await self._serving

    async def _serve(self, listening: socket.socket) -> None:
        await load(lambda: [importlib.import_module(library) for library in LIBRARIES])
        from uvicorn.config import Config
        from uvicorn.server import ServerState

        from roboglot.transport.http import BoundedConnection

        config = Config(
            self, ws="none", lifespan="off", interface="asgi3", log_config=None, access_log=False, proxy_headers=False
        )
        config.load()
        state, loop = ServerState(), asyncio.get_running_loop()
        self._connections = state.connections
        self._server = await loop.create_server(
            lambda: BoundedConnection(config, state, {}, loop), sock=listening, backlog=BACKLOG
        )

    async def __call__(self, scope: Scope, _receive: Receive, send: Send) -> None:
        try:
            if why := self._browsers.refusal(of_rows(scope["headers"], scope["method"])):
                raise Problem(403, why)
            if scope["method"] not in ("GET", "HEAD"):
                raise Problem(405, "this page is read-only; a world's own console does more")
            await self._route(scope, send)
        except Problem as problem:
            await answer_json(send, {"error": problem.why}, problem.status)

    async def _route(self, scope: Scope, send: Send) -> None:
        match [part for part in scope["path"].split("/") if part]:
            case []:
                await answer(send, 303, b"text/plain", b"", [(b"location", PAGE.encode())])
            case ["api", "fleet"]:
                query = parse_qs(scope["query_string"].decode("ascii", "replace"))
                seen = [name for name in query.get("seen", [""])[0].split(",") if name]
                await answer_json(send, await self.look(seen))
            case ["api", "fleet", name, "map.png"]:
                await self._send_picture(unquote(name), send)
            case _:
                await self._send_file(scope["path"], send)

    async def look(self, seen: list[str]) -> dict[str, object]:
        """Return all worlds, and the states of the robots on a page. Raises Problem."""
        if len(seen) > SEEN_MAX:
            raise Problem(400, f"a page shows {SEEN_MAX} robots at most")
        try:
            states = await asyncio.gather(*map(self._snapshots.state, seen))
        except LookupError as error:
            raise Problem(404, str(error.args[0])) from None
        worlds = [_world(shard) for shard in self._fleet_host.shards.values()]
        return {"worlds": worlds, "robots": dict(zip(seen, states, strict=True))}

    async def _send_picture(self, name: str, send: Send) -> None:
        try:
            picture = await self._snapshots.picture(name)
        except LookupError as error:
            raise Problem(404, str(error.args[0])) from None
        except Refused as refused:
            raise Problem(502, str(refused)) from None
        await answer(send, 200, b"image/png", picture, [(b"cache-control", b"no-store")])

    async def _send_file(self, path: str, send: Send) -> None:
        asset = self._assets.find(path)
        if asset is None:
            raise Problem(404, "there is no such page")
        more = [(b"cache-control", b"no-cache"), (b"content-security-policy", self._assets.policy)]
        await answer(send, 200, asset.content_type.encode(), asset.plain, more)


def _world(shard: Shard) -> dict[str, object]:
    return {
        "name": shard.plan.name,
        "state": str(shard.state),
        "reason": shard.trouble,
        "factor": shard.beat.factor,
        "restarts": shard.restarts,
        "console": shard.ready.console if shard.ready else "",
        "robots": [
            {"name": robot["name"], "body": robot.get("body", "universal"), "address": robot["address"]}
            for robot in shard.plan.settings["robots"]
        ],
    }
