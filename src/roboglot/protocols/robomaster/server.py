"""The RoboMaster door: opens the ports, joins the parts, closes them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from ipaddress import IPv4Address
from pathlib import Path

from roboglot.media.audio import AudioStream
from roboglot.media.video import VideoStream
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.door import Endpoint
from roboglot.protocols.gate import Gate
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.connection import ControlConnection
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.datagrams import Datagrams, broadcast_address
from roboglot.protocols.robomaster.limits import CONTROL_CONNECTIONS_MAX, MEDIA_CONNECTIONS_MAX, PILOTS_MAX
from roboglot.protocols.robomaster.liveness import ClientWatch
from roboglot.protocols.robomaster.ports.discovery import announce
from roboglot.protocols.robomaster.ports.event_port import Readers
from roboglot.protocols.robomaster.ports.media_port import MediaPort
from roboglot.protocols.robomaster.ports.pilot_port import Pilots
from roboglot.protocols.robomaster.ports.serial_line import LINE_END, SERIAL, SerialLine
from roboglot.protocols.robomaster.table import implemented, key_of
from roboglot.wire.robomaster.replies import PROFILES

__all__ = ["RoboMasterDoor", "implemented"]

CONNECTIONS_MAX = {"video": MEDIA_CONNECTIONS_MAX, "audio": MEDIA_CONNECTIONS_MAX, "pilot": PILOTS_MAX}
PORT_RIGHTS = {"pilot": Right.DRIVE}  # required to connect; all other ports require SEE
# Addresses of a robot on its own Wi-Fi or a USB cable: clients know them, so it announces nothing.
KNOWN_ADDRESSES = frozenset({"192.168.2.1", "192.168.42.2"})


class RoboMasterDoor:
    """Speaks the EP's text protocol for ``robot`` on ``address`` (IPv4); TCP ports of 0 choose free ones."""

    name = "robomaster"

    def __init__(self, robot: Robot, address: str, config: RoboMasterConfig) -> None:
        self.video = MediaPort(robot, VideoStream)
        self.audio = MediaPort(robot, AudioStream)
        self.context = Context(robot, PROFILES[config.profile], self)
        self._address = address
        self._config = config
        self._connections: set[ControlConnection] = set()
        self._watch = ClientWatch(
            lambda: [connection.driver for connection in self._connections],
            self.context.moves,
            self.context.stop_speaker,
        )
        self._gate = Gate(robot.admission)
        self._events = Readers()
        self._explanations = Readers()
        self._pilots = Pilots(robot)
        self._servers: dict[str, asyncio.Server] = {}
        self._datagrams: Datagrams | None = None
        self._serial: SerialLine | None = None
        self._serial_link = Path(f"{config.uart}-{robot.id}")
        self._announcing: asyncio.Task[None] | None = None
        self._leave_responder: Callable[[], None] = lambda: None

    async def start(self) -> None:
        """Listen on all ports and announce the robot. Raises OSError naming an address that is taken."""
        loop = asyncio.get_running_loop()
        try:
            IPv4Address(self._address)
        except ValueError:
            raise OSError(f"{self._address} is not an IPv4 address, and the text protocol needs one") from None
        ports: dict[str, tuple[Callable[[], asyncio.Protocol], int | None]] = {
            "text SDK": (self._control_connection, self._config.control_port),
            "events": (self._events.connect, self._config.event_port),
            "video": (self.video.connect, self._config.video_port),
            "audio": (self.audio.connect, self._config.audio_port),
            "explanations": (self._explanations.connect, self._config.explanation_port),
            "pilot": (self._pilots.connect, self._config.pilot_port),
        }
        try:
            self._datagrams = Datagrams(self._address)
            for name, (factory, port) in ports.items():
                if port is not None:
                    right, most = PORT_RIGHTS.get(name, Right.SEE), CONNECTIONS_MAX.get(name, CONTROL_CONNECTIONS_MAX)
                    what = f"robomaster {name}"
                    self._servers[name] = await self._gate.listen(factory, what, self._address, port, right, most)
            if self._config.uart:
                self._serial = SerialLine(self._serial_link, self._serial_connection)
        except OSError:
            await self.close()
            raise
        if (responder := self.context.robot.responder) is not None:
            self._leave_responder = responder.join(self.name, self._play)
        if self._address not in KNOWN_ADDRESSES:
            self._announcing = loop.create_task(
                announce(self.context, self._address, self._broadcast), name="robomaster ip"
            )

    async def close(self) -> None:
        """Stop listening, disconnect clients and cancel their actions, without waiting for the robot to brake."""
        if self._announcing:
            self._announcing.cancel()
        self._leave_responder()
        self._watch.close()
        self._gate.close()
        for server in self._servers.values():
            server.close()
        for connection in tuple(self._connections):
            connection.transport.abort()
        for port in (self._events, self._explanations, self._pilots, self.video, self.audio):
            port.close()
        self.context.end("the door closes")
        for server in self._servers.values():
            await server.wait_closed()
        if self._datagrams:
            self._datagrams.close()
        self._datagrams = None

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The control port first, then the others, the serial line, and the destination of datagrams."""
        ports = {name: server.sockets[0].getsockname()[1] for name, server in self._servers.items()}
        # bash and coreutils exist everywhere; nc does not, and its options differ.
        trial = (
            f'bash -c "exec 3<>/dev/tcp/{self._address}/{ports["text SDK"]}; '
            "printf 'command;chassis position ?;quit;' >&3; timeout 1 cat <&3\""
        )
        trials = {"text SDK": trial}
        if port := ports.get("explanations"):
            trials["explanations"] = f'bash -c "cat </dev/tcp/{self._address}/{port}"'
        else:
            trials["text SDK"] += "  # why did it fail? start with --explain"
        listed = [
            Endpoint(f"RoboMaster {name}", f"tcp {self._address}:{port}", trials.get(name, ""))
            for name, port in ports.items()
        ]
        if self._serial:
            listed.append(Endpoint("RoboMaster serial line", str(self._serial_link)))
        return (*listed, Endpoint("RoboMaster pushes", f"udp to the client's port {self._config.push_port}"))

    # -- output of the session --

    def push(self, datagram: bytes, host: str) -> None:
        """Send a datagram from the robot's own address to the client's host, or write it to the serial line."""
        place, admission = f"{host}:{self._config.push_port}", self.context.robot.admission
        self._note(datagram, place)
        if self._serial and host == SERIAL:
            self._serial.write(datagram + LINE_END)
        elif self._datagrams and admission.carries_datagrams(place):  # a tunnel takes its copies from the tap
            self._datagrams.send(datagram, host, self._config.push_port)

    def send_event(self, event: bytes) -> None:
        """Send an event to all readers of the event port and to the serial line."""
        self._note(event, f"event port {self._config.event_port}")
        self._events.write(event)
        if self._serial:
            self._serial.write(event + LINE_END)

    def _play(self, operation: str, message: bytes) -> None:
        """Send a responder's push: an event to its readers, any other to every client's host."""
        if operation.endswith(" event"):
            self.send_event(message)
        elif operation != "> robot ip":  # this robot is elsewhere and reports it itself
            for host in {connection.host for connection in self._connections}:
                self.push(message, host)

    # -- connections --

    def _control_connection(self) -> asyncio.Protocol:
        self._watch.begin()
        return ControlConnection(self.context, self._connections, self._explain, lenient=self._config.lenient)

    def _serial_connection(self) -> asyncio.Protocol:
        return ControlConnection(self.context, self._connections, self._explain, line_end=LINE_END)

    def _explain(self, text: Callable[[], str]) -> None:
        if self._explanations:
            self._explanations.write(f"{text()}\n".encode())

    def _note(self, message: bytes, to: str) -> None:
        tap = self.context.robot.tap
        if tap.watched:
            tap.push("robomaster", to, key_of(message), message)

    def _broadcast(self, datagram: bytes, own: str) -> None:
        """Broadcast to the network of one of the robot's own addresses."""
        to, port = broadcast_address(own), self._config.broadcast_port
        self._note(datagram, f"{to}:{port}")
        if own == self._address and self._datagrams:
            self._datagrams.send(datagram, to, port)
        elif own not in KNOWN_ADDRESSES:
            with suppress(OSError), closing(Datagrams(own)) as datagrams:  # the address may have gone
                datagrams.send(datagram, to, port)
