"""Queue of program frames to the app: lossless, answers first; programs wait for a slow app.

One frame is under way at a time, as on real robots: each is a call of its own, and the threads of an app that gets
several at once read them in any order. Knows neither gRPC nor the frames' contents. Unlike an outbox, this queue drops
nothing that an app waits for.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from dataclasses import field
from enum import Enum, IntEnum, auto
from heapq import heappop, heappush

from roboglot.model.clock import Clock
from roboglot.values import dataclass

log = logging.getLogger(__name__)

ROOM = 32  # queued events before programs must wait
NEWS_MAX = 4096  # events queued for an app that acknowledges nothing; beyond this the oldest are dropped
ANSWERS_MAX = 8 * 1024 * 1024  # bytes of queued answers before further requests must wait
ANSWERS_KEPT_MAX = 4 * ANSWERS_MAX  # bytes of answers for an app that is away
KEPT_SECONDS = 30.0  # for which answers are kept for an absent app
TRIES_MAX = 20  # per frame, while the app's heartbeats arrive
RETRY_SECONDS = 0.2


class Delivery(Enum):
    """Result of one push."""

    DONE = auto()
    SILENT = auto()
    """It was sent, and not acknowledged in time."""
    FAILED = auto()
    """The connection broke under it: the app may not have it."""


class _Rank(IntEnum):
    ANSWER = 0
    NEWS = 1


@dataclass(slots=True, order=True)
class _Frame:
    """A queued frame; ordered by precedence."""

    rank: _Rank
    number: int
    text: str = field(compare=False)
    size: int = field(compare=False)  # bytes
    stamp: float = field(compare=False)  # robot time, s
    tries: int = field(default=0, compare=False)


class FrameQueue:
    """A ``FrontEnd`` of the relay; ``send`` is one push. ``open`` when the app is there, ``shut`` when it is lost."""

    def __init__(self, send: Callable[[str], Awaitable[Delivery]], clock: Clock, longest: int) -> None:
        self.longest = longest
        self._send = send
        self._clock = clock
        self._waiting: list[_Frame] = []
        self._sending: asyncio.Task[None] | None = None
        self._numbers = 0
        self._news = self._answers = 0  # of events, of answers; bytes of answers
        self._there = self._silent = self._holding = False
        self._wanted_until = 0.0
        self._has_room, self._has_room_for_answers = asyncio.Event(), asyncio.Event()
        self._update_room()

    def answer(self, text: str) -> None:
        """Send an answer ahead of news; kept for a while if its client is being dialled."""
        if self._there or self._clock.time() < self._wanted_until:
            self._put(_Rank.ANSWER, text)

    def publish(self, text: str) -> None:
        """Send news of a task, in order; an absent app misses it."""
        if self._there:
            self._put(_Rank.NEWS, text)

    async def drain(self) -> None:
        """Wait for the app to catch up; returns at once if it is lost or acknowledges nothing."""
        await self._has_room.wait()

    async def drain_answers(self) -> None:
        """Wait until another request may be answered."""
        await self._has_room_for_answers.wait()
        self._wanted_until = self._clock.time() + KEPT_SECONDS

    def open(self) -> None:
        """Handle the app's arrival: send what is queued and not too old."""
        self._there, self._silent, self._holding = True, False, False
        self._forget(lambda frame: frame.stamp < self._clock.time() - KEPT_SECONDS, "is too old for the app")
        self._go_on()

    def shut(self) -> None:
        """Handle the app's loss: drop the queue, but keep answers for a while."""
        self._there = False
        self._forget(lambda frame: frame.rank is _Rank.NEWS, "is for an app that was lost")
        self._update_room()

    def close(self) -> None:
        """Stop sending."""
        self._there = False
        if self._sending:
            self._sending.cancel()
        self._waiting.clear()
        self._news = self._answers = 0
        self._update_room()

    def _put(self, rank: _Rank, text: str) -> None:
        self._numbers += 1
        self._add(_Frame(rank, self._numbers, text, len(text.encode()), self._clock.time()))
        if self._news > NEWS_MAX:
            self._drop_older_half(_Rank.NEWS)
        if self._answers > ANSWERS_KEPT_MAX:
            self._drop_older_half(_Rank.ANSWER)
        self._go_on()

    def _add(self, frame: _Frame) -> None:
        heappush(self._waiting, frame)
        self._count(frame, 1)

    def _count(self, frame: _Frame, change: int) -> None:
        if frame.rank is _Rank.NEWS:
            self._news += change
        else:
            self._answers += change * frame.size

    def _drop_older_half(self, rank: _Rank) -> None:
        numbers = sorted(frame.number for frame in self._waiting if frame.rank is rank)
        middle = numbers[len(numbers) // 2]
        self._forget(lambda frame: frame.rank is rank and frame.number <= middle, "finds the queue full")

    def _forget(self, unwanted: Callable[[_Frame], bool], why: str) -> None:
        dropped = [frame for frame in self._waiting if unwanted(frame)]
        if dropped:
            log.info("a program frame %s; %d dropped", why, len(dropped))
            for frame in dropped:
                self._count(frame, -1)
            self._waiting = sorted(frame for frame in self._waiting if not unwanted(frame))  # a sorted list is a heap

    def _go_on(self) -> None:
        """Send the next frame unless one is under way, and wake the waiting sender."""
        if self._waiting and self._there and not self._holding and self._sending is None:
            frame = heappop(self._waiting)
            self._count(frame, -1)
            self._sending = asyncio.get_running_loop().create_task(self._carry(frame), name="program frame")
            self._sending.add_done_callback(self._carried)
        self._update_room()

    async def _carry(self, frame: _Frame) -> None:
        match await self._send(frame.text):
            case Delivery.DONE:
                self._silent = False
            case Delivery.SILENT:
                if not self._silent:
                    log.warning(
                        "the app does not acknowledge program frames: programs go on without it, their frames are late"
                    )
                self._silent = True
            case Delivery.FAILED:
                self._keep(frame)

    def _carried(self, task: asyncio.Task[None]) -> None:
        self._sending = None
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("cannot send a program frame: %s", error, exc_info=error)
        self._go_on()

    def _keep(self, frame: _Frame) -> None:
        """Requeue a frame of uncertain delivery at its old place, so that nothing overtakes it."""
        frame.tries += 1
        if frame.tries >= TRIES_MAX:
            log.warning("the app refused a program frame %d times: it is dropped", frame.tries)
        elif self._there or frame.rank is _Rank.ANSWER:
            self._add(frame)
            if not self._holding:
                self._holding = True
                self._clock.call_later(RETRY_SECONDS, self._try_again)

    def _try_again(self) -> None:
        self._holding = False
        self._go_on()

    def _update_room(self) -> None:
        _set(self._has_room, not self._there or self._silent or self._news < ROOM)
        _set(self._has_room_for_answers, not self._there or self._answers < ANSWERS_MAX)


def _set(event: asyncio.Event, on: bool) -> None:
    if on:
        event.set()
    else:
        event.clear()
