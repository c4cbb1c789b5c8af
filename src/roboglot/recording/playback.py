"""Plays a recorded robot: answers recorded requests with their recorded answers, and repeats recorded pushes.

A request is matched by operation and parameters; fresh ids and times of clients are ignored, and numbers may differ a
little. A command, which changes something, is matched in the order of the session, each once. A reading request gets
the answers recorded between the last command and the next one: in order, then the last one again. Answers and pushes
keep their recorded times after the command that they followed.
"""

from __future__ import annotations

import logging
import math
import re
from bisect import bisect_right
from collections import defaultdict
from collections.abc import AsyncIterator, Callable, Collection, Sequence
from dataclasses import field
from functools import partial
from pathlib import Path

from roboglot.model.clock import Clock
from roboglot.model.errors import NotFound
from roboglot.model.responder import Recorded, Responder, ResponderReply
from roboglot.model.tap import Exchange
from roboglot.recording.matching import NormalizedRequest, normal, rewritten, with_seq, without_numbers
from roboglot.recording.reader import AnsweredRequest, BadRecording, Recording, pair, parts, read_recording
from roboglot.recording.redaction import FIELDS, Redaction
from roboglot.recording.timeline import Timeline
from roboglot.spelling import instead
from roboglot.values import dataclass

log = logging.getLogger(__name__)
OFF = 0.1  # tolerance of a request's number: absolute
OFF_SHARE = 0.02  # ... or relative
MISSING_MAX = 1000  # unrecorded requests that are kept
DAY = 86_400.0
LARGE = 20_000_000  # bytes of a recording that takes a while to read
IDS_MAX = 10_000
_query = re.compile(rb"\?(?:\s+seq\s+\d+)?[\s;]*$")
_inquiry = re.compile(rb'"operate"\s*:\s*"inquiry"')
_time = re.compile(rb"(?<![\w.])1[5-9]\d{8}(?:\d{3}){0,3}(?![\w])")


@dataclass(slots=True)
class _Door:
    """Session of one door: the requests so far, and its progress."""

    timeline: Timeline
    asked: list[tuple[AnsweredRequest, NormalizedRequest]] = field(default_factory=list)
    by_text: dict[str, list[int]] = field(default_factory=lambda: defaultdict(list))  # indices into ``asked``
    by_form: dict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    pushes: list[tuple[int, Exchange]] = field(default_factory=list)
    used: set[int] = field(default_factory=set)
    cursor: int = -1  # index of the last command
    listeners: list[Callable[[str, bytes], None]] = field(default_factory=list)
    ids: dict[bytes, bytes] = field(default_factory=dict)
    reads: set[str] = field(default_factory=set)  # operations without side effects
    scheduled: set[int] = field(default_factory=set)  # numbers of pushes
    begun: bool = False


class Playback(Responder):
    """One recorded robot. ``missing``: requests that were never recorded."""

    def __init__(self, exchanges: Sequence[Exchange], clock: Clock, epoch: float, redact: Sequence[str] = ()) -> None:
        """``epoch``: Unix time (s) at the recording's robot time 0; ``redact``: further fields redacted in it."""
        self._clock, self._epoch = clock, epoch
        self._redaction = Redaction((*FIELDS, *redact))
        self._doors: dict[str, _Door] = defaultdict(lambda: _Door(Timeline(clock)))
        self.missing: list[tuple[str, str]] = []
        asked, pushes = pair(exchanges)
        for one in asked:
            door = self._doors[one.request.door]
            # Older versions redacted fewer fields; live requests are redacted as now before they are matched.
            found = normal(one.request.door, self._redaction.exchange(one.request).payload)
            place = len(door.asked)
            door.asked.append((one, found))
            key = f"{one.request.operation}\n{found.text}"
            door.by_text[key].append(place)
            door.by_form[without_numbers(key)[0]].append(place)
        for number, push in pushes:
            self._doors[push.door].pushes.append((number, push))

    async def answer(self, door: str, operation: str, payload: bytes, *, reads: bool) -> AsyncIterator[ResponderReply]:
        """See ``Responder``."""
        began = self._clock.time()
        live = normal(door, self._redaction.of(door, operation)(payload))  # in the form of the recording
        kept = self._doors[door]
        used = len(kept.used)
        place = self._find(kept, operation, live, reads=reads)
        if place is None:
            self._note_missing(door, operation, live)
            raise NotFound(f"the recording has no such request: {operation or live.text[:80]}")
        asked, recorded = kept.asked[place]
        for old, new in zip(recorded.fresh, live.fresh, strict=False):
            if len(kept.ids) < IDS_MAX:
                kept.ids[old] = new
        if not kept.begun or not reads:
            self._schedule(kept, place if not reads else -1, asked.request.stamp, began)
        kept.begun = True
        in_order = len(kept.used) > used  # not twice
        for index, (number, reply) in enumerate(asked.numbered, 1):
            due = began + max(0.0, reply.stamp - asked.request.stamp)
            await kept.timeline.turn(due, number, in_order=in_order)
            payload = self._as_now(reply, recorded.fresh, live.fresh)
            if door == "robomaster":
                payload = with_seq(payload, recorded.fresh, live.fresh)
            yield ResponderReply(payload, reply.status, index == len(asked.numbered))

    def join(self, door: str, send: Callable[[str, bytes], None], reads: Collection[str] = ()) -> Callable[[], None]:
        """See ``Responder``."""
        self._doors[door].reads |= set(reads)
        listeners = self._doors[door].listeners
        listeners.append(send)
        return lambda: listeners.remove(send) if send in listeners else None

    def first_push(self, door: str, operation: str) -> bytes | None:
        """See ``Responder``."""
        pushes = self._doors[door].pushes if door in self._doors else []
        return next((push.payload for _, push in pushes if push.operation == operation), None)

    def close(self) -> None:
        """Stop all pushes."""
        for door in self._doors.values():
            door.timeline.close()

    # -- matching requests to recorded ones --

    def _find(self, door: _Door, operation: str, live: NormalizedRequest, *, reads: bool) -> int | None:
        key = f"{operation}\n{live.text}"
        places = door.by_text.get(key) or self._near(door, key)
        if not places:
            return None
        if reads:
            return self._find_read(door, places)
        place = next((p for p in places if p not in door.used and p > door.cursor), None)
        if place is None:  # out of order, or repeated
            place = next((p for p in places if p not in door.used), places[-1])
        door.used.add(place)
        door.cursor = max(door.cursor, place)
        return place

    def _find_read(self, door: _Door, places: Sequence[int]) -> int:
        """Return the index of the read to answer with: between the last command and the next, else an earlier one."""
        after = bisect_right(places, door.cursor)
        until = self._next_change(door)
        window = [place for place in places[after:] if place < until]
        for place in window:
            if place not in door.used:
                door.used.add(place)
                return place
        if window:
            return window[-1]
        return places[after - 1] if after else places[0]

    def _next_change(self, door: _Door) -> int:
        """Return the index of the next recorded command; beyond the end if there is none."""
        for place in range(door.cursor + 1, len(door.asked)):
            if place not in door.used and self._changes(door, door.asked[place][0].request):
                return place
        return len(door.asked)

    @staticmethod
    def _changes(door: _Door, request: Exchange) -> bool:
        if request.door == "slamware":
            return not request.payload.startswith((b"GET ", b"HEAD "))
        if request.door == "robomaster":
            return not _query.search(request.payload)
        if request.door == "visual":
            if request.operation.startswith("/"):  # another path than that of the frames
                return request.operation == "/debug"
            return not _inquiry.search(request.payload)
        return request.operation not in door.reads

    @staticmethod
    def _near(door: _Door, key: str) -> list[int]:
        """Return the indices of requests with nearly the same numbers."""
        form, numbers = without_numbers(key)
        return [
            place
            for place in door.by_form.get(form, ())
            if all(
                math.isclose(mine, theirs, rel_tol=OFF_SHARE, abs_tol=OFF)
                for mine, theirs in zip(numbers, _numbers(door.asked[place]), strict=True)
            )
        ]

    def _note_missing(self, door: str, operation: str, live: NormalizedRequest) -> None:
        if len(self.missing) < MISSING_MAX:
            self.missing.append((door, operation or live.text[:80]))
            text = live.text[:200]
            request = text if operation in text else f"{operation} {text}"
            log.warning("%s: not in the recording: %s", door, request.strip())

    # -- pushes --

    def _schedule(self, door: _Door, place: int, since: float, now: float) -> None:
        """Schedule the pushes between this command and the next one; ``since``: recorded time of ``now``."""
        first = door.asked[place][0].number if place >= 0 else -1
        last = math.inf
        for later in range(place + 1, len(door.asked)):
            if self._changes(door, door.asked[later][0].request):
                last = door.asked[later][0].number
                break
        for number, push in door.pushes:
            if first < number < last and number not in door.scheduled:
                door.scheduled.add(number)
                due = now + max(0.0, push.stamp - since)
                door.timeline.push(due, number, partial(self._push, door, push))

    def _push(self, door: _Door, push: Exchange) -> None:
        payload = self._as_now(push, tuple(door.ids), tuple(door.ids.values()))
        for send in tuple(door.listeners):
            send(push.operation, payload)

    def _as_now(self, recorded: Exchange, old: tuple[bytes, ...], new: tuple[bytes, ...]) -> bytes:
        """Return a recorded payload with current ids, and Unix times moved to now; files are unchanged."""
        try:
            recorded.payload.decode()
        except UnicodeDecodeError:
            return recorded.payload
        payload = rewritten(recorded.payload, old, new)
        then = self._epoch + recorded.stamp
        shift = self._clock.epoch() - then

        def move(match: re.Match[bytes]) -> bytes:
            unit = 10 ** (len(match.group()) - 10)
            value = int(match.group())
            if abs(value / unit - then) > DAY:
                return match.group()
            return b"%d" % round(value + shift * unit)

        return _time.sub(move, payload)


def _numbers(asked: tuple[AnsweredRequest, NormalizedRequest]) -> tuple[float, ...]:
    return without_numbers(f"{asked[0].request.operation}\n{asked[1].text}")[1]


def open_playback(place: str, clock: Clock) -> Playback:
    """Return the robot of ``FILE`` or ``FILE#ROBOT``. Raises ValueError in plain words."""
    path, _, name = place.partition("#")
    try:
        if (size := sum(part.stat().st_size for part in parts(Path(path)))) > LARGE:
            log.info("reading %s, %.0f MB; this takes some seconds", path, size / 1e6)
        recording = read_recording(Path(path))
    except OSError as error:
        raise ValueError(f"recording {path}: {error.strerror}") from None
    chosen = _robot(recording, name)
    redact = tuple(filter(None, recording.facts.get("redact", "").split(", ")))
    played = Playback(recording.of(chosen), clock, recording.epoch, redact)
    own = chosen or next(iter(recording.robots), "")
    others = tuple(other for other in recording.robots if other != own)
    played.recorded = Recorded(recording.path, own, others, recording.first, recording.last)
    return played


def _robot(recording: Recording, name: str) -> str:
    if not name and len(recording.robots) > 1:
        raise BadRecording(f"{recording.path} has the robots {', '.join(recording.robots)}: say {recording.path}#NAME")
    if name and name not in recording.robots:
        raise BadRecording(f"{recording.path} has no robot {name!r}{instead(name, recording.robots)}")
    return name
