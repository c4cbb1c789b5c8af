"""A live feed: one source of frames, sounds or packets, any number of viewers, and no work without one."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from roboglot.model.errors import Busy

T = TypeVar("T")
VIEWERS_MAX = 64


class Viewer(Generic[T]):
    """One viewer's bounded queue: an async iterator that ends when the feed does. Close it, or use ``with``.

    A slow reader loses its queue and continues at the next item where one can join; ``dropped`` counts.
    """

    def __init__(self, feed: Feed[T], maxlen: int) -> None:
        self._feed = feed
        self._queue: deque[T] = deque()
        self._maxlen = maxlen
        self._wakeup = asyncio.Event()
        self._joined = False
        self.closed = False
        self.dropped = 0

    def __enter__(self) -> Viewer[T]:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __aiter__(self) -> Viewer[T]:
        return self

    async def __anext__(self) -> T:
        while not self._queue:
            if self.closed:
                raise StopAsyncIteration
            self._wakeup.clear()
            await self._wakeup.wait()
        return self._queue.popleft()

    @property
    def waiting(self) -> int:
        """Number of items that are queued now."""
        return len(self._queue)

    def drain(self) -> list[T]:
        """Return all that is queued now, oldest first, without waiting."""
        items = list(self._queue)
        self._queue.clear()
        return items

    def close(self) -> None:
        """Unsubscribe; queued items can still be read."""
        if not self.closed:
            self.closed = True
            self._wakeup.set()
            self._feed._leave(self)

    def _push(self, item: T, joinable: bool) -> None:
        if len(self._queue) >= self._maxlen:
            self.dropped += len(self._queue)
            self._queue.clear()
            self._joined = False
        if not self._joined and not joinable:
            self.dropped += 1
            return
        self._joined = True
        self._queue.append(item)
        self._wakeup.set()


class Feed(Generic[T]):
    """``begin`` is called when the first viewer comes, ``end`` when the last one has gone."""

    def __init__(
        self,
        begin: Callable[[], None],
        end: Callable[[], None],
        *,
        queue_max: int,
        joinable: Callable[[T], bool] = lambda _item: True,
    ) -> None:
        self._begin, self._end, self._queue_max, self._joinable = begin, end, queue_max, joinable
        self._viewers: list[Viewer[T]] = []

    @property
    def viewers(self) -> int:
        """Number of viewers."""
        return len(self._viewers)

    @property
    def unread(self) -> bool:
        """True while every viewer has unread items."""
        return all(viewer.waiting for viewer in self._viewers)

    def subscribe(self) -> Viewer[T]:
        """Return a new viewer. Raises Busy beyond VIEWERS_MAX, and what ``begin`` raises."""
        if len(self._viewers) >= VIEWERS_MAX:
            raise Busy(f"{VIEWERS_MAX} viewers already")
        viewer = Viewer(self, self._queue_max)
        self._viewers.append(viewer)
        if len(self._viewers) == 1:
            try:
                self._begin()
            except BaseException:  # else further viewers would wait for what never began
                self._viewers.remove(viewer)
                raise
        return viewer

    def push(self, item: T) -> None:
        """Send ``item`` to every viewer."""
        joinable = self._joinable(item)
        for viewer in tuple(self._viewers):
            viewer._push(item, joinable)

    def close(self) -> None:
        """End the feed for all viewers."""
        for viewer in tuple(self._viewers):
            viewer.close()

    def _leave(self, viewer: Viewer[T]) -> None:
        self._viewers.remove(viewer)
        if not self._viewers:
            self._end()
