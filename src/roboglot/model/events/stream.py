"""The bounded stream on which events are published. Knows no kind of event."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Generic, Protocol, TypeVar, cast

from roboglot.model.events.listeners import Failures
from roboglot.values import dataclass

QUEUE_MAX = 256  # unread events per reader, beyond which the oldest is dropped


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened; ``stamp`` is robot time in seconds."""

    stamp: float


E_ = TypeVar("E_", bound=Event)


class _Receiver(Protocol):
    """Receiver of events of some types."""

    @property
    def types(self) -> tuple[type[Event], ...]: ...

    def push(self, event: Event) -> None: ...


class Subscription(Generic[E_]):
    """A reader's own queue of events; the oldest are dropped (and counted) when it reads too slowly."""

    def __init__(self, stream: EventStream, types: tuple[type[E_], ...], maxlen: int) -> None:
        self._stream = stream
        self.types = types
        self._queue: deque[E_] = deque(maxlen=maxlen)
        self._wakeup = asyncio.Event()
        self.dropped = 0

    def __enter__(self) -> Subscription[E_]:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop receiving."""
        self._stream._forget(self)

    def push(self, event: Event) -> None:
        """Take an event of these types; the stream calls this."""
        if len(self._queue) == self._queue.maxlen:
            self.dropped += 1
        self._queue.append(cast(E_, event))
        self._wakeup.set()

    def drain(self) -> list[E_]:
        """Return all that is queued now, oldest first, without waiting."""
        events = list(self._queue)
        self._queue.clear()
        self._wakeup.clear()
        return events

    async def next(self) -> E_:
        """Wait for the next event and return it."""
        while not self._queue:
            self._wakeup.clear()
            await self._wakeup.wait()
        return self._queue.popleft()

    async def __aiter__(self) -> AsyncIterator[E_]:
        while True:
            yield await self.next()


class EventStream:
    """Delivers every event to the subscribers of its type."""

    def __init__(self) -> None:
        self._subscriptions: list[_Receiver] = []
        self._listeners: list[tuple[type[Event], Callable[[Event], None]]] = []
        self._receivers: dict[type[Event], tuple[Callable[[Event], None], ...]] = {}  # by the type of a published event
        self._delivering = False
        self._nested = deque[Event]()
        self._failures = Failures()

    def publish(self, event: Event) -> None:
        """Deliver ``event`` at once: listeners are called, subscriptions get it queued.

        One that a listener publishes follows when the present one is delivered to all, so that all see one order. A
        listener that raises keeps no event from the others.
        """
        if self._delivering:
            self._nested.append(event)
            return
        self._delivering = True
        try:
            while True:
                receivers = self._receivers.get(type(event))
                if receivers is None:
                    receivers = self._receivers[type(event)] = self._receivers_of(type(event))
                for receive in receivers:
                    try:
                        receive(event)
                    except Exception as error:  # noqa: BLE001 - logged there
                        self._failures.note(receive, event, error)
                if not self._nested:
                    break
                event = self._nested.popleft()
        finally:
            self._delivering = False
            if self._nested:  # a listener broke
                self.publish(self._nested.popleft())

    def _receivers_of(self, kind: type[Event]) -> tuple[Callable[[Event], None], ...]:
        listeners = (listener for wanted, listener in self._listeners if issubclass(kind, wanted))
        return (*listeners, *(s.push for s in self._subscriptions if issubclass(kind, s.types)))

    def subscribe(self, *types: type[E_], maxlen: int = QUEUE_MAX) -> Subscription[E_]:
        """Return a queue of further events of these types; close it (or use ``with``)."""
        subscription = Subscription(self, types, maxlen)
        self._subscriptions.append(subscription)
        self._receivers.clear()
        return subscription

    def listen(self, kind: type[E_], listener: Callable[[E_], None]) -> Callable[[], None]:
        """Call ``listener`` on every event of ``kind``, synchronously; return a function that unsubscribes it."""
        entry = (kind, cast(Callable[[Event], None], listener))
        self._listeners.append(entry)
        self._receivers.clear()

        def end() -> None:
            if entry in self._listeners:
                self._listeners.remove(entry)
                self._receivers.clear()

        return end

    def _forget(self, subscription: Subscription[E_]) -> None:
        if subscription in self._subscriptions:
            self._subscriptions.remove(subscription)
            self._receivers.clear()
