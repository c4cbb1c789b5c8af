"""Sends answers and pushes of one door in the order of the recording, however late the machine is.

Timers alone do not: when a busy machine finds several due at once, a push is sent inside its timer, but an answer only
wakes the task that will send it. So one timer serves all, and after an answer the rest waits until that task has run.
"""

from __future__ import annotations

import asyncio
from bisect import bisect_right, insort
from collections.abc import Callable
from dataclasses import field

from roboglot.model.clock import Clock, Timer
from roboglot.values import dataclass

EARLIER = 0.25  # s for which an answer waits for pushes recorded before it


@dataclass(order=True, slots=True)
class _Item:
    due: float
    number: int
    send: Callable[[], bool] = field(compare=False)  # returns True if another task continues from here


class Timeline:
    """Pending messages, ordered by time, then by number in the recording."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._items: list[_Item] = []
        self._timer: Timer | None = None
        self._giving_way = False

    def push(self, due: float, number: int, send: Callable[[], None]) -> None:
        """Call ``send`` in its turn; ``due``: s of robot time."""

        def play() -> bool:
            send()
            return False

        self._add(_Item(due, number, play))

    async def turn(self, due: float, number: int, *, in_order: bool) -> None:
        """Wait for the turn of an answer; it must be sent before its task waits for anything else.

        ``in_order``: nearly due messages that were recorded earlier go first.
        """
        if in_order:
            first, last = self._place(due), self._place(due + EARLIER)
            due = max([due, *(item.due for item in self._items[first:last] if item.number < number)])
        woken: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def wake() -> bool:
            if woken.done():
                return False
            woken.set_result(None)
            return True

        self._add(_Item(due, number, wake))
        await woken

    def close(self) -> None:
        """Drop all pending messages."""
        self._items.clear()
        self._arm()

    def _place(self, due: float) -> int:
        return bisect_right(self._items, due, key=lambda item: item.due)

    def _add(self, item: _Item) -> None:
        if not self._items or item < self._items[0]:
            self._items.insert(0, item)
            self._arm()
        else:
            insort(self._items, item)

    def _arm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._clock.call_at(self._items[0].due, self._run) if self._items else None

    def _run(self) -> None:
        if self._giving_way:
            return
        now = self._clock.time() + 1e-9
        while self._items and self._items[0].due <= now:
            if self._items.pop(0).send():
                self._giving_way = True
                asyncio.get_running_loop().call_soon(self._go_on)  # after the task that was just woken
                return
        self._arm()

    def _go_on(self) -> None:
        self._giving_way = False
        self._run()
