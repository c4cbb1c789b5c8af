"""The RoboMaster door: opens the ports, joins the parts, closes them.

Video (40921) and audio (40922) are not listened on: clients connect there only after ``stream on`` and ``audio on``,
which answer ``fail`` for now.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from ipaddress import IPv4Address

from roboglot.config import RoboMasterConfig
from roboglot.model.robot import Robot
from roboglot.protocols.door import Endpoint
from roboglot.protocols.robomaster.connection import ControlConnection
from roboglot.protocols.robomaster.datagrams import Datagrams, broadcast_address
from roboglot.protocols.robomaster.discovery import announce
from roboglot.protocols.robomaster.dispatch import implemented
from roboglot.protocols.robomaster.readers import EventReader
from roboglot.protocols.robomaster.session import Session
from roboglot.wire.robomaster.replies import SPEC

__all__ = ["RoboMasterDoor", "implemented"]


class RoboMasterDoor:
    """Speaks the EP's text protocol for ``robot`` on ``address`` (IPv4); TCP ports of 0 choose free ones."""

    name = "robomaster"

    def __init__(self, robot: Robot, address: str, config: RoboMasterConfig) -> None:
        self.session = Session(robot, SPEC, self._push)
        self._address = address
        self._config = config
        self._connections: set[ControlConnection] = set()
        self._readers: set[EventReader] = set()
        self._servers: list[asyncio.Server] = []
        self._datagrams: Datagrams | None = None
        self._announcing: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Listen on the control and event ports, begin to announce; OSError names the address that is taken."""
        loop = asyncio.get_running_loop()
        try:
            everywhere = IPv4Address(self._address).is_unspecified
        except ValueError:
            raise OSError(f"{self._address} is no IPv4 address, and the text protocol knows no others") from None
        try:
            self._datagrams = Datagrams(self._address)
            for factory, port in (
                (self._control_connection, self._config.control_port),
                (self._event_reader, self._config.event_port),
            ):
                self._servers.append(await loop.create_server(factory, self._address, port))
        except OSError:
            await self.close()
            raise
        if not everywhere:  # that is no address to announce
            self._announcing = loop.create_task(
                announce(self.session, self._address, self._broadcast), name="robomaster ip"
            )

    async def close(self) -> None:
        """Stop listening, drop the clients, tell the robot to stop what they began (its braking isn't waited for)."""
        if self._announcing:
            self._announcing.cancel()
        for server in self._servers:
            server.close()
        for transport in [peer.transport for peer in self._connections] + [peer.transport for peer in self._readers]:
            transport.abort()
        self.session.end("the door closes")
        for server in self._servers:
            await server.wait_closed()
        if self._datagrams:
            self._datagrams.close()
        self._datagrams = None

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The control port, the event port, and where datagrams go."""
        control, event = (server.sockets[0].getsockname()[1] for server in self._servers)
        return (
            Endpoint(
                "RoboMaster text SDK",
                f"tcp {self._address}:{control}",
                # bash and coreutils are everywhere; nc isn't, and its options differ.
                f'bash -c "exec 3<>/dev/tcp/{self._address}/{control}; '
                "printf 'command;chassis position ?;quit;' >&3; timeout 1 cat <&3\"",
            ),
            Endpoint("RoboMaster events", f"tcp {self._address}:{event}"),
            Endpoint("RoboMaster pushes", f"udp to the client's port {self._config.push_port}"),
        )

    def _control_connection(self) -> asyncio.Protocol:
        return ControlConnection(self.session, self._connections)

    def _event_reader(self) -> asyncio.Protocol:
        return EventReader(self._readers)

    def _push(self, datagram: bytes, host: str) -> None:
        if self._datagrams:
            self._datagrams.send(datagram, host, self._config.push_port)

    def _broadcast(self, datagram: bytes) -> None:
        if self._datagrams:
            self._datagrams.send(datagram, broadcast_address(self._address), self._config.broadcast_port)
