"""The robot as a client of the phone app: heartbeats, loss, redialling, pushes. Knows no message by name.

Real robots learn the app's address from a QR code. Here it is configured, or it is where the last request came from;
the app that was connected last is dialled again after a restart.
"""

from __future__ import annotations

import asyncio
import logging
import zlib
from collections.abc import Callable
from functools import lru_cache
from urllib.parse import unquote

from roboglot.model.clock import Clock
from roboglot.model.inputs.external import ExternalInputs
from roboglot.model.tap import Tap
from roboglot.protocols.cyberdog.app_line import BROKEN, DONE, AppLine, Credentials, delivery
from roboglot.protocols.cyberdog.frame_queue import Delivery
from roboglot.protocols.cyberdog.outbox import Outbox
from roboglot.protocols.cyberdog.table import Push
from roboglot.transport.limiter import pay
from roboglot.transport.log_limiter import LogLimiter
from roboglot.values import dataclass
from roboglot.wire.cyberdog.channel import HEARTBEAT_DEADLINE, HEARTBEAT_PERIOD, LOST_AFTER, PUSH_DEADLINE, PUSH_MAX
from roboglot.wire.cyberdog.chapters.system import HEARTBEAT, Beats
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.text import write

log = logging.getLogger(__name__)
limited_log = LogLimiter(log)
WILDCARDS = ("0.0.0.0", "::")
EARLY_MAX = 0.75
REDIAL_FIRST, REDIAL_MAX = 1.0, 16.0  # s between two attempts: first, then doubled up to the maximum
REDIAL_CALLED = 4.0  # s at most, while clients keep calling


@dataclass(frozen=True, slots=True)
class AppRoute:
    """Route from the robot's ``own`` address to the app: ``configured`` host[:port], or the ``last`` one.

    ``unasked``: the configured app is dialled before a client has called. ``pace``: real s to wait before dialling.
    """

    own: str
    configured: str
    app_port: int
    last: str = ""
    unasked: bool = True
    pace: Callable[[], float] = lambda: 0.0


def early_share(address: str) -> float:
    """Return the share of a period by which the second heartbeat is early, to spread the heartbeats of many dogs."""
    return EARLY_MAX * zlib.crc32(address.encode()) / 0xFFFFFFFF


class AppLink:
    """Dials the app and keeps the connection; ``connected`` while heartbeats get through."""

    def __init__(
        self,
        clock: Clock,
        credentials: Credentials,
        route: AppRoute,
        *,
        ticks: Callable[[str], pb.Ticks],
        tap: Tap | None = None,
        inputs: ExternalInputs | None = None,
        on_host: Callable[[str], None] = lambda _: None,
    ) -> None:
        """``on_host`` is called with the host that is connected."""
        self.connected = False
        self.on_found: list[Callable[[], None]] = []
        self.on_lost: list[Callable[[], None]] = []
        configured, app_port, last = route.configured, route.app_port, route.last
        self._address = route.own
        self._clock = clock
        self._credentials = credentials
        self._configured = configured if not configured or ":" in configured else f"{configured}:{app_port}"
        self._app_port = app_port
        self._ticks = ticks
        self._tap = tap
        self._inputs = inputs or ExternalInputs("", clock)
        known = self._configured or (f"{last}:{app_port}" if last else "")
        self._target = known if route.unasked or not self._configured else ""
        self._pace = route.pace
        self._host, self._on_host = last, on_host
        self._news = asyncio.Event()  # set when the address changes or a client calls: dial at once
        self._line: AppLine | None = None
        self._ended = False
        self._called = False  # since the last dial: one call is as good as many
        self._outboxes: dict[int, Outbox] = {}
        self._beats = Beats()
        self._task: asyncio.Task[None] | None = None
        self._asking: list[asyncio.Future[bool]] = []  # waiting for the next heartbeat

    def start(self) -> None:
        """Start dialling the known address."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name="app link")

    async def close(self) -> None:
        """Close the connection and stop sending."""
        self._ended = True
        if self._task:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        for outbox in self._outboxes.values():
            await outbox.close()

    def seen(self, peer: str) -> None:
        """Record a request from ``peer`` (as gRPC writes it): the app may be there."""
        if self.connected and self._target:
            return  # calls of other clients must not take the app's place
        before = self._target
        if self._configured:
            self._target = self._configured
        elif host := host_of(peer):
            self._target = f"{host}:{self._app_port}"
        if self._target != before or not self._called:
            self._called = True
            self._news.set()

    def forget(self) -> None:
        """Drop the address: no heartbeats until the next request comes."""
        self._target = ""
        self._remember("")
        self._news.set()

    async def alive(self) -> bool:
        """Return whether a heartbeat sent from now on gets through; if none does, the app is lost."""
        if not self.connected:
            return False
        answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._asking.append(answer)
        return await answer

    def push(self, push: Push, payload: object) -> None:
        """Queue ``payload``; dropped unless the app is connected. Never waits."""
        if not self.connected:
            return
        text = write(payload)
        if len(text.encode()) > PUSH_MAX:
            log.warning("push %d of %d characters is more than an app can take: not sent", push.code, len(text))
            return
        if push.code not in self._outboxes:
            self._outboxes[push.code] = Outbox(push.code, push.depth, self.send)
        self._outboxes[push.code].put(text)

    async def _run(self) -> None:
        pause, called = REDIAL_FIRST, False
        while True:
            if not self._target:
                await self._news.wait()
                self._answer_calls()
                continue
            target = self._target
            if await self._keep(target):
                pause, called = REDIAL_FIRST, False
            if self._target == target:
                called = await self._rest(target, pause, min(pause, REDIAL_CALLED) if called else 0.0)
                pause = min(2.0 * pause, REDIAL_MAX)

    async def _rest(self, target: str, pause: float, least: float) -> bool:
        """Wait ``pause`` s until ``target`` is dialled again, but after ``least`` only for a call of a client.

        Return whether one called, perhaps during the attempt before. A change of the address ends the wait.
        """
        begun, called = self._clock.time(), False
        end = begun + pause
        while self._target == target and (left := end - self._clock.time()) > 0.0:
            try:
                await self._clock.wait_for(self._news.wait(), left)
            except TimeoutError:
                break
            self._news.clear()
            called, end = True, min(end, begun + least)
        self._called = False
        return called

    def _answer_calls(self) -> None:
        """Note that a dial begins, or has succeeded: later calls count again."""
        self._called = False
        self._news.clear()

    async def _keep(self, target: str) -> bool:
        """Dial ``target`` and send heartbeats until it is lost or moves; return whether one got through."""
        await pay(self._pace())
        self._line = line = AppLine(target, self._credentials)
        try:
            return await self._beat(target, line)
        finally:
            self._line = None
            self._set_connected(False)
            await (line.close() if self._ended else self._inputs.call_out("close", line.close))

    async def _beat(self, target: str, line: AppLine) -> bool:
        heard, own = False, self._address
        if own in WILDCARDS:
            own = await self._inputs.call_out("route", lambda: _route_to(target))
        last = self._clock.time()
        while self._target == target:
            began, asked, ticks = self._clock.time(), len(self._asking), self._ticks(own)
            if known := self.connected:
                self._note(ticks)
            if not await self._got_through(line, ticks):
                if self._clock.time() - last >= LOST_AFTER:
                    break
            else:
                if not heard:
                    began -= HEARTBEAT_PERIOD * early_share(self._address)
                heard, last = True, self._clock.time()
                if not known:  # the app was found and has answered
                    self._note(ticks)
                self._set_connected(True)
                self._answer(self._asking[:asked], True)
                del self._asking[:asked]
            await self._clock.sleep_until(max(began + HEARTBEAT_PERIOD, self._clock.time()))
        return heard

    async def _got_through(self, line: AppLine, ticks: pb.Ticks) -> bool:
        asking = self._inputs.call_out(HEARTBEAT, lambda: line.heartbeat(ticks))
        try:
            outcome = await self._clock.wait_for(asking, HEARTBEAT_DEADLINE)
        except TimeoutError:
            log.debug("no heartbeat within %s s", HEARTBEAT_DEADLINE)
            return False
        _note_error(HEARTBEAT, outcome)
        return outcome == DONE

    def _note(self, ticks: pb.Ticks) -> None:
        """Report a delivered heartbeat to the tap."""
        if self._tap is None or not self._tap.watched:
            self._beats.forget()
        elif news := self._beats.news(ticks):
            self._tap.push("cyberdog", self._target, HEARTBEAT, news)

    def _answer(self, asking: list[asyncio.Future[bool]], alive: bool) -> None:
        for answer in asking:
            if not answer.done():
                answer.set_result(alive)

    def _set_connected(self, connected: bool) -> None:
        if connected == self.connected:
            return
        self.connected = connected
        self._answer_calls()
        log.info("app at %s %s", self._target or "a forgotten address", "connected" if connected else "lost")
        if connected:
            self._remember(self._target.rpartition(":")[0])
        else:
            self._beats.forget()
            for outbox in self._outboxes.values():
                outbox.clear()
            asking, self._asking = self._asking, []
            self._answer(asking, False)
        for listener in self.on_found if connected else self.on_lost:
            listener()

    def _remember(self, host: str) -> None:
        if host != self._host and not self._configured:
            self._host = host
            self._on_host(host)

    async def send(self, code: int, text: str) -> Delivery:
        """Send one push, independently of others; return once it is acknowledged or given up."""
        if (line := self._line) is None:
            return Delivery.FAILED
        key = str(int(code))
        if self._tap is not None and self._tap.watched:
            self._tap.push("cyberdog", self._target, key, text)
        try:
            asking = self._inputs.call_out(key, lambda: line.push(code, text))
            outcome = await self._clock.wait_for(asking, PUSH_DEADLINE)
        except TimeoutError:
            limited_log.warning(
                f"no end of {key}",
                "the app did not answer push %s within %s s; until it does, it gets only one push in that time",
                key,
                PUSH_DEADLINE,
            )
            return Delivery.SILENT
        _note_error(f"push {key}", outcome)
        return delivery(outcome)


def _note_error(what: str, outcome: str) -> None:
    """Log an error that the app itself returned, not the loss of the connection."""
    if outcome != DONE and outcome not in BROKEN:
        limited_log.warning(f"{outcome} of {what}", "the app answers %s with the error %s", what, outcome)


@lru_cache(64)
def host_of(peer: str) -> str:
    """Return the host in "ipv4:1.2.3.4:5" or "ipv6:%5B::1%5D:5" (its brackets kept); empty for any other kind."""
    kind, _, rest = unquote(peer).partition(":")
    return rest.rpartition(":")[0] if kind in ("ipv4", "ipv6") else ""


async def _route_to(target: str) -> str:
    """Return the local address that ``target`` (host:port) can reach; empty without a route."""
    host, _, port = target.rpartition(":")
    loop = asyncio.get_running_loop()
    try:
        # Connecting a datagram socket sends nothing; it only looks up a route.
        transport, _ = await loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, remote_addr=(host.strip("[]"), int(port))
        )
    except (OSError, ValueError):
        return ""
    address: str = transport.get_extra_info("sockname")[0]
    transport.close()
    return address
