"""The client of one robot: commands by chapter, pushes and events, and a link that reconnects."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from enum import StrEnum

from roboglot.clients.errors import ClientError, LinkLost
from roboglot.clients.robomaster.calls import ANSWER_SECONDS, REFUSALS
from roboglot.clients.robomaster.chapters.ai import Ai
from roboglot.clients.robomaster.chapters.arm import RoboticArm
from roboglot.clients.robomaster.chapters.armor import Armor
from roboglot.clients.robomaster.chapters.blaster import Blaster
from roboglot.clients.robomaster.chapters.camera import Audio, Camera, Stream
from roboglot.clients.robomaster.chapters.chassis import Chassis
from roboglot.clients.robomaster.chapters.game import GameMessages
from roboglot.clients.robomaster.chapters.gimbal import Gimbal
from roboglot.clients.robomaster.chapters.gripper import RoboticGripper
from roboglot.clients.robomaster.chapters.ir_distance import IrDistanceSensor
from roboglot.clients.robomaster.chapters.led import Led
from roboglot.clients.robomaster.chapters.pwm import Pwm
from roboglot.clients.robomaster.chapters.robot import RobotChapter
from roboglot.clients.robomaster.chapters.sensor_adapter import SensorAdapter
from roboglot.clients.robomaster.chapters.servo import Servo
from roboglot.clients.robomaster.chapters.sound import Sound
from roboglot.clients.robomaster.control import ControlLink, connect
from roboglot.clients.robomaster.datagrams import PUSH_PORT, PushPort
from roboglot.clients.robomaster.errors import RoboMasterRefused
from roboglot.clients.robomaster.events import EventLink
from roboglot.clients.robomaster.listeners import Listeners
from roboglot.clients.robomaster.media import access_units, opus_packets
from roboglot.clients.robomaster.noting import Noting
from roboglot.clients.robomaster.search import Search
from roboglot.model.clock import Clock, RealClock
from roboglot.model.feed import Viewer
from roboglot.model.tap import Line
from roboglot.values import dataclass
from roboglot.wire.robomaster.annexb import AccessUnit
from roboglot.wire.robomaster.replies import Reply
from roboglot.wire.robomaster.telemetry import Telemetry

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Ports:
    """Ports of the robot, and the local one for pushes; real robots have no others."""

    control: int = 40923
    video: int = 40921
    audio: int = 40922
    event: int = 40925
    push: int = PUSH_PORT


PORTS = Ports()


class LinkState(StrEnum):
    """State of the control connection."""

    CLOSED = "closed"
    CONNECTED = "connected"
    LOST = "lost"  # and the client is reconnecting


class RoboMasterClient:
    """``async with RoboMasterClient("192.168.2.1") as client: await client.chassis.move(x=0.5, wait=True)``.

    Commands raise RoboMasterRefused (the robot's own words), LinkLost, TimedOut and BadAnswer. While the link is lost
    commands raise at once: none is queued. ``clock`` measures every time-out and pause. ``local`` is the
    address to connect from. ``pushes`` is shared with the other clients of the program, if there are any.
    """

    def __init__(
        self,
        host: str,
        *,
        clock: Clock | None = None,
        ports: Ports = PORTS,
        pushes: PushPort | None = None,
        local: str | None = None,
        reconnect: bool = True,
    ) -> None:
        self.host = host
        self.clock = clock or RealClock()
        self.state = LinkState.CLOSED
        self.robot, self.chassis, self.gimbal = RobotChapter(self.ask), Chassis(self.ask), Gimbal(self.ask)
        self.blaster, self.armor, self.sound = Blaster(self.ask), Armor(self.ask), Sound(self.ask)
        self.pwm, self.led, self.servo = Pwm(self.ask), Led(self.ask), Servo(self.ask)
        self.sensor_adapter, self.ir_distance_sensor = SensorAdapter(self.ask), IrDistanceSensor(self.ask)
        self.robotic_arm, self.robotic_gripper = RoboticArm(self.ask), RoboticGripper(self.ask)
        self.ai, self.camera, self.stream = Ai(self.ask), Camera(self.ask), Stream(self.ask)
        self.audio, self.game_msg = Audio(self.ask), GameMessages(self.ask)
        self._ports, self._local, self._reconnect = ports, local, reconnect
        self._pushes = pushes or PushPort(local or "", ports.push)
        self._detach: Callable[[], None] | None = None
        self._listeners = Listeners()
        self._events = EventLink(self.clock, ports.event, self._listeners.dispatch)
        self._link: ControlLink | None = None
        self._noting: Noting | None = None
        self._search = Search(self.clock, host, self._open, lambda: self.state is LinkState.CONNECTED)
        self._at_change: list[Callable[[LinkState], object]] = []

    async def __aenter__(self) -> RoboMasterClient:
        await self.connect()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def connect(self) -> None:
        """Connect and enter SDK mode. Raises LinkLost, TimedOut, RoboMasterRefused; then it may be tried again.

        No effect while connected; during a search the robot is tried at once.
        """
        if self.state is LinkState.CONNECTED:
            return
        self._search.cancel()
        try:
            await self._open()
        except ClientError:
            if self.state is LinkState.LOST and self._reconnect:
                self._search.begin()
            raise
        await self._events.open(self.host)

    async def close(self) -> None:
        """Disconnect: the robot stops this client's motions, and leaves SDK mode after the last client."""
        self._change(LinkState.CLOSED)
        self._search.cancel()
        self._events.close()
        if self._link:
            self._link.close()
            await self._link.closed.wait()
        if self._detach:
            self._detach()
            self._detach = None
        self._listeners.close()

    def note_in(self, line: Line) -> None:
        """Record commands, answers and pushes in ``line``; call before ``connect``."""
        self._noting = self._listeners.noting = Noting(line)

    @property
    def as_robots(self) -> bool:
        """True if it answers as real robots' builds do, whose units, orders and numbers differ from the manual's.

        Known after ``learn_build``.
        """
        return self._link is not None and self._link.as_robots

    @property
    def push_port(self) -> int:
        """UDP port of this machine for pushes."""
        return self._ports.push

    @property
    def descriptor(self) -> int:
        """Descriptor of the control connection, for its watchdog. Raises LinkLost."""
        if self._link is None or not self._link.open:
            raise LinkLost(f"{self.host} is not connected")
        return self._link.descriptor

    async def learn_build(self) -> None:
        """Ask for the charge without a number: robots' builds end such a value with a blank, or with no ``;``."""
        if self._link is None or not self._link.open:
            raise LinkLost(f"{self.host} is not connected")
        await self._link.ask("robot battery ?", ANSWER_SECONDS, numbered=False)

    # -- commands --

    async def ask(self, command: str, timeout: float = ANSWER_SECONDS) -> str:
        """Send the text of any command (without ``;``) and return the raw answer, even a refusal."""
        if self._link is None or not self._link.open:
            raise LinkLost(f"{self.host} is not connected: {command!r} was not sent")
        return await self._link.ask(command, timeout)

    async def command(self) -> None:
        """Enter SDK mode (3.2.1.1); no effect if entered."""
        await self._expect("command", Reply.OK, Reply.ALREADY_IN_SDK_MODE)

    async def quit(self) -> None:
        """Leave SDK mode, for all clients: the robot stops and resets (3.2.1.2)."""
        await self._expect("quit", Reply.OK)

    async def version(self) -> str:
        """``00.00.00.70``; in no manual."""
        return (await self._expect("version")).removeprefix("version ")

    async def _expect(self, command: str, *right: str) -> str:
        answer = await self.ask(command, 5 * ANSWER_SECONDS)  # the robot answers `quit` once it has stopped
        if answer in REFUSALS or (right and answer not in right):
            raise RoboMasterRefused(command, answer)
        return answer

    # -- pushes and events --

    def listen(self, heard: Callable[[Telemetry], object], *kinds: type[Telemetry]) -> Callable[[], None]:
        """Call ``heard`` with pushes and events of ``kinds`` (none: all); return a function to stop. Raises LinkLost.

        The robot sends only what has been switched on (``chassis.push``, ``armor.event`` …).
        """
        if self._detach is None:
            address = self._link.peer_host if self._link else self.host
            self._detach = self._pushes.attach(address, self._listeners.dispatch)
        return self._listeners.add(heard, kinds)

    def watch(self, *kinds: type[Telemetry]) -> Viewer[Telemetry]:
        """Return pushes and events as an async iterator; close it, or use ``with``. It ends with the client."""
        return self._listeners.view(lambda heard: self.listen(heard, *kinds))

    def video(self) -> AsyncIterator[AccessUnit]:
        """Yield H.264 access units, from a keyframe on, while ``stream.on()``. Ends with LinkLost."""
        return access_units(self.clock, self.host, self._ports.video)

    def sounds(self) -> AsyncIterator[bytes]:
        """Yield Opus packets of 20 ms while ``audio.on()``. Ends with LinkLost."""
        return opus_packets(self.clock, self.host, self._ports.audio)

    # -- the link --

    def at_connect(self, hook: Callable[[], Awaitable[object]]) -> None:
        """Await ``hook`` after every reconnection: a new session begins with everything off."""
        self._search.at_find(hook)

    def at_change(self, hook: Callable[[LinkState], object]) -> None:
        """Call ``hook`` whenever ``state`` changes."""
        self._at_change.append(hook)

    def _change(self, state: LinkState) -> None:
        if state is not self.state:
            self.state = state
            for hook in self._at_change:
                hook(state)

    async def _open(self) -> None:
        self._link = link = await connect(
            self.clock, self.host, self._ports.control, self._local, self._lost, self._noting
        )
        try:
            await self.command()
        except BaseException:
            link.close()
            raise
        self._change(LinkState.CONNECTED)

    def _lost(self, why: str) -> None:
        if self.state is not LinkState.CONNECTED:
            return
        log.info("lost robomaster %s: %s", self.host, why)
        self._change(LinkState.LOST)
        if self._reconnect and not self._search.going_on:
            self._search.begin()
