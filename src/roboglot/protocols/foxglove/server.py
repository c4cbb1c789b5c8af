"""The door: a WebSocket for Foxglove, Lichtblick and similar viewers, which show the robot's topics and drive it."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from roboglot.model.background import load
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.browsers import Browsers
from roboglot.protocols.channels import Carrier, Channel, noted, taking_turns
from roboglot.protocols.door import Endpoint
from roboglot.protocols.foxglove.config import FoxgloveConfig
from roboglot.protocols.foxglove.vocabulary import DOOR, stops
from roboglot.protocols.websocket import WebSocketServer
from roboglot.transport.tls import Tls
from roboglot.wire.foxglove.messages import SUBPROTOCOLS

if TYPE_CHECKING:
    from roboglot.protocols.foxglove.channels import Source
    from roboglot.protocols.foxglove.session import Session

CLIENTS_MAX = 16
# They need the libraries of an extra, loaded for the first client; their ``open_source`` takes the robot.
LIVE, RECORDED = "roboglot.protocols.foxglove.topics", "roboglot.protocols.foxglove.player"


class FoxgloveDoor:
    """Foxglove door of one robot."""

    name = DOOR

    def __init__(self, robot: Robot, address: str, config: FoxgloveConfig, tls: Tls | None = None) -> None:
        self.robot, self.config = robot, config
        self._topics: Source | None = None
        self._opening = asyncio.Lock()
        self._sessions: set[Session] = set()
        self._socket: WebSocketServer | None = None
        if config.enabled:
            browsers = Browsers(f"[{DOOR}]", config.origins, config.hosts, robot.admission)
            channel = taking_turns(Channel(self._open, Right.SEE, SUBPROTOCOLS, binary=True), robot, stops)
            channel = noted(channel, robot.inputs, DOOR, "/")
            self._socket = WebSocketServer(
                {"/": channel}, address, config.port, browsers, robot.admission, tls, door=DOOR
            )

    async def start(self) -> None:
        """Listen. Raises OSError naming an address that is taken."""
        if self._socket is not None:
            await self._socket.start()

    async def close(self) -> None:
        """Close all connections; the clients' actions end."""
        if self._socket is not None:
            await self._socket.close()
        for session in tuple(self._sessions):
            session.close()
        if self._topics is not None:
            self._topics.close()

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The WebSocket's address."""
        if self._socket is None:
            return ()
        return [Endpoint("Foxglove", f"{self._socket.scheme}://{self._socket.address}:{self._socket.port}")]

    async def topics(self) -> Source:
        """Return the robot's topics, live or recorded. Raises ImportError (without the extra), OSError, ValueError."""
        async with self._opening:
            if self._topics is None:
                name = RECORDED if self.robot.responder is not None and self.robot.responder.recorded else LIVE
                module = await load(lambda: import_module(name))
                source: Source = await module.open_source(self.robot)
                self._topics = source
        return self._topics

    def _open(self, carrier: Carrier) -> Session:
        if len(self._sessions) >= CLIENTS_MAX:
            raise RuntimeError(f"more than {CLIENTS_MAX} clients")
        from roboglot.protocols.foxglove.context import Context
        from roboglot.protocols.foxglove.session import Session

        session = Session(Context(self.robot, carrier, self.config), self.topics, self._sessions.discard)
        self._sessions.add(session)
        return session
