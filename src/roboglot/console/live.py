"""The socket of one page: sends changed data, the newest only, and receives the person's requests.

A slow page misses frames: each kind of message has one slot, in which the next one replaces it.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections.abc import Awaitable, Callable, Mapping

import msgspec

from roboglot.console import drawings
from roboglot.console.desk import CLIENT, Desk
from roboglot.console.settings import (
    BATCH_MAX,
    MESSAGES_PER_SECOND_MAX,
    NAME_MAX,
    OTHERS_BEATS,
    REQUESTS_MAX,
    STATE_BEATS,
    WIRE_MAX,
)
from roboglot.console.teleop import Pad, Velocity
from roboglot.console.views import RobotView
from roboglot.console.wire_log import rows
from roboglot.model.client_context import client, connection, identity, set_client
from roboglot.model.errors import RobotError
from roboglot.operations import BadParameters, Right
from roboglot.transport.limiter import Limiter

log = logging.getLogger(__name__)
Send = Callable[[str | bytes], Awaitable[None]]
_numbers = itertools.count(1)


class Hello(msgspec.Struct, tag="hello", tag_field="type", forbid_unknown_fields=True):
    """Name of the person at the page."""

    name: str = ""


class Watch(msgspec.Struct, tag="watch", tag_field="type", forbid_unknown_fields=True):
    """Robot that the page shows; flags for its wire, the truth, and its camera's detections.

    ``moving``: the page draws the robot, so it gets scan, path and map, and poses at each beat instead of each second.
    """

    robot: str
    wire: bool = False
    truth: bool = False
    seen: bool = False
    moving: bool = True


class Request(msgspec.Struct, tag="do", tag_field="type", forbid_unknown_fields=True):
    """A command; ``robot`` empty: to the world. The answer carries ``id``."""

    id: int
    verb: str
    robot: str = ""
    values: dict[str, object] = {}


class Ping(msgspec.Struct, tag="ping", tag_field="type", forbid_unknown_fields=True):
    """Answered at once with the same ``at``."""

    at: float


Message = Hello | Watch | Request | Ping | Velocity


def milliseconds() -> float:
    """Return the server's time for stamps, ms."""
    return round(time.monotonic() * 1000.0, 1)


class Page:
    """One open page."""

    def __init__(self, desk: Desk, send: Send, named: str) -> None:
        """``named``: the client's proven identity; empty: the client may choose a name."""
        self._desk, self._send, self._named = desk, send, named
        self._source = f"{CLIENT} page {next(_numbers)}"
        self._client = client()
        self._watched: RobotView | None = None
        self._watch = Watch("")
        self._pads: dict[str, Pad] = {}
        self._replies: asyncio.Queue[dict[str, object]] = asyncio.Queue(REQUESTS_MAX * 4)
        self._sent: dict[str, dict[str, object]] = {}
        self._frames: dict[str, bytes] = {}
        self._truth: dict[str, object] = {}
        self._boxes: list[list[object]] = []
        self._wire_at = 0
        self._requests: set[asyncio.Task[None]] = set()
        self._rate = Limiter(MESSAGES_PER_SECOND_MAX, 2.0 * MESSAGES_PER_SECOND_MAX, time.monotonic)
        self._due = asyncio.Event()
        self._refused = ""
        self.person = identity()
        self._resends_all = True

    # -- out --

    async def run(self) -> None:
        """Send until cancelled."""
        while True:
            if self._resends_all:
                self._resends_all = False
                self._sent.clear()
                await self._send_message({"type": "hello", **self._desk.hello(), "now": milliseconds()})
            await self._due.wait()
            self._due.clear()
            while not self._replies.empty():
                await self._send_message(self._replies.get_nowait())
            if self._beat > self._shown:
                before, self._shown = self._shown, self._beat
                await self._show(before, self._beat)

    _beat = _shown = -1

    @property
    def moving(self) -> bool:
        """True if the page draws a robot and needs updates as often as possible."""
        return self._watch.moving

    def resend_all(self) -> None:
        """Send robots and rights again: they have changed."""
        self._resends_all = True
        self._due.set()

    def beat(self, number: int) -> None:
        """Trigger an update; a page that is still sending skips it."""
        self._beat = number
        self._due.set()

    async def _show(self, before: int, beat: int) -> None:
        """Send changed data; ``before``: number of the last shown beat."""

        def due(beats: int) -> bool:
            return before // beats != beat // beats

        visible = self._desk.visible
        if self._watch.moving or due(OTHERS_BEATS):
            await self._show_moment(visible)
        for name, view in visible.items():
            watched = view is self._watched
            if name not in self._sent or due(STATE_BEATS if watched else OTHERS_BEATS):
                await self._show_state(name, view.state_at(beat))
        if self._watched in visible.values():
            assert self._watched is not None
            if self._watch.moving:
                await self._show_frames(self._watched)
            if self._watch.seen and (boxes := self._watched.sightings.boxes) != self._boxes:
                self._boxes = boxes
                await self._send_message({"type": "seen", "robot": self._watched.robot.id, "boxes": boxes})
            if self._watch.wire and due(STATE_BEATS):
                await self._show_wire(self._watched)

    async def _show_moment(self, visible: Mapping[str, RobotView]) -> None:
        motion = {name: view.motion for name, view in visible.items()}
        moment: dict[str, object] = {"type": "moment", "now": milliseconds(), "time": self._desk.world.clock.time()}
        moment["pace"] = self._desk.pace
        moment["poses"] = motion
        moment["recording"] = self._desk.recordings is not None and self._desk.recordings.on
        whole = len(visible) == len(self._desk.views)  # the world view shows all robots
        if self._watch.truth and whole and (truth := drawings.truth_of(self._desk.stage)) != self._truth:
            self._truth = moment["truth"] = truth
        await self._send_message(moment)

    async def _show_state(self, name: str, state: dict[str, object]) -> None:
        before = self._sent.get(name, {})
        changed = {key: value for key, value in state.items() if key not in before or before[key] != value}
        if changed:
            self._sent[name] = state
            await self._send_message({"type": "state", "robot": name, "state": changed})

    async def _show_frames(self, view: RobotView) -> None:
        for kind, frame in (("scan", view.scan), ("path", view.path), ("map", view.map)):
            if frame is not None and self._frames.get(kind) is not frame:
                self._frames[kind] = frame
                await self._send(frame)

    async def _show_wire(self, view: RobotView) -> None:
        first = not self._wire_at  # a new page gets the whole history
        new = view.wire.after(self._wire_at, WIRE_MAX if first else BATCH_MAX)
        for batch in (new[start : start + BATCH_MAX] for start in range(0, len(new), BATCH_MAX)):
            if view is not self._watched:
                return
            skipped = 0 if first else batch[0].number - self._wire_at - 1
            self._wire_at = batch[-1].number
            await self._send_message({"type": "wire", "robot": view.robot.id, "rows": rows(batch), "skipped": skipped})

    async def _send_message(self, message: Mapping[str, object]) -> None:
        await self._send(msgspec.json.encode(message).decode())

    # -- in --

    def receive(self, text: str | bytes) -> None:
        """Handle a message of the page. Raises ValueError for a bad message, or for too many."""
        if not self._rate.take(""):
            raise ValueError("too many messages")
        match msgspec.json.decode(text, type=Message):
            case Ping(at=at):
                self._reply({"type": "pong", "at": at, "now": milliseconds()})
            case Velocity() as velocity:
                self._drive(velocity)
            case Hello(name=name):
                self._introduce(name)
            case Watch() as watch:
                self._look_at(watch)
            case Request() as request:
                self._begin(request)

    def _introduce(self, name: str) -> None:
        name = name.strip()
        if not self._named and name.isprintable() and 0 < len(name) <= NAME_MAX:
            self._client = f"{CLIENT} {name}"
            set_client(self._client, connection(), identity())
        self._reply({"type": "you", "client": self._client})

    def _look_at(self, watch: Watch) -> None:
        view = self._desk.visible.get(watch.robot)
        if self._watched is not None:
            if self._watch.wire:
                self._watched.wire.close()
            if self._watch.seen:
                self._watched.stop_looking()
        if view is not self._watched:
            if self._watched is not None:
                self._watched.close()
            self._watched = view
            self._frames = {}
            self._wire_at = 0
            if view is not None:
                view.open()
        self._truth = self._truth if self._watch.truth else {}  # the page has forgotten it
        self._watch = watch
        if view is not None:
            if watch.wire:
                view.wire.open()
            if watch.seen:
                view.start_looking()

    def _drive(self, velocity: Velocity) -> None:
        view = self._desk.views.get(velocity.robot)
        if view is None:
            return
        pad = self._pads.setdefault(velocity.robot, Pad(view.robot, self._source))
        why = ""
        try:
            self._desk.check(view.robot, "drive", Right.DRIVE)
            with view.robot.admission.noting(CLIENT, "drive"):
                pad.drive(velocity, milliseconds())
        except RobotError as error:
            why = str(error)
        if why != self._refused:  # reported once, not for every message
            self._refused = why
            self._reply({"type": "pad", "robot": velocity.robot, "refused": why})

    def _begin(self, request: Request) -> None:
        room = REQUESTS_MAX if request.robot else 2 * REQUESTS_MAX  # those that wait for a paused clock leave some
        if len(self._requests) >= room:
            self._reply({"type": "done", "id": request.id, "error": "too many commands are under way"})
            return
        task = asyncio.get_running_loop().create_task(self._carry_out(request), name=f"console {request.verb}")
        self._requests.add(task)
        task.add_done_callback(self._requests.discard)

    async def _carry_out(self, request: Request) -> None:
        answer: dict[str, object] = {"type": "done", "id": request.id}
        try:
            if request.robot:
                answer["result"] = await self._desk.command(request.robot, request.verb, request.values, self._client)
            else:
                answer["result"] = await self._desk.change_world(request.verb, request.values)
        except (RobotError, BadParameters, ValueError) as error:
            answer["error"] = str(error) or type(error).__name__
        except Exception as error:  # the page waits for its answer
            log.exception("console: %s crashed", request.verb)
            answer["error"] = f"internal error: {error}"
        self._reply(answer)

    def _reply(self, message: dict[str, object]) -> None:
        if self._replies.full():  # the page does not read its answers
            self._replies.get_nowait()
        self._replies.put_nowait(message)
        self._due.set()

    def close(self) -> None:
        """Close the page: its manual driving stops; accepted commands go on."""
        for pad in self._pads.values():
            pad.let_go("the page that drove is gone")
        self._look_at(Watch(""))
