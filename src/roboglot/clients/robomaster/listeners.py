"""Listeners to a robot's pushes and events: functions and watchers, each for the kinds that it wants."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.clients.robomaster.noting import Noting
from roboglot.model.events.listeners import Failures
from roboglot.model.feed import Feed, Viewer
from roboglot.wire.robomaster.telemetry import Telemetry, parse_pushes

QUEUE_MAX = 512  # pushes and events queued for a slow watcher; further ones are dropped

Listener = Callable[[Telemetry], object]


class Listeners:
    """Listeners of one client, until ``close``; ``noting``, if set, records received messages."""

    def __init__(self) -> None:
        self.noting: Noting | None = None
        self._listeners: list[tuple[Listener, tuple[type[Telemetry], ...]]] = []
        self._feeds: set[Feed[Telemetry]] = set()
        self._failures = Failures()

    def add(self, heard: Listener, kinds: tuple[type[Telemetry], ...]) -> Callable[[], None]:
        """Call ``heard`` with values of ``kinds`` (none: all); return a function to stop."""
        entry = (heard, kinds)
        self._listeners.append(entry)
        return lambda: self._listeners.remove(entry) if entry in self._listeners else None

    def view(self, listen: Callable[[Listener], Callable[[], None]]) -> Viewer[Telemetry]:
        """Return a viewer of values from ``listen``, which starts on first use."""
        stop: list[Callable[[], None]] = []

        def end() -> None:
            stop.pop()()
            self._feeds.discard(feed)

        feed: Feed[Telemetry] = Feed(lambda: stop.append(listen(feed.push)), end, queue_max=QUEUE_MAX)
        viewer = feed.subscribe()
        self._feeds.add(feed)
        return viewer

    def dispatch(self, data: bytes) -> None:
        """Parse a datagram or an event's line, and pass it on."""
        if self.noting is not None:
            self.noting.note_push(data)
        for item in parse_pushes(data):
            for heard, kinds in tuple(self._listeners):
                if not kinds or isinstance(item, kinds):
                    try:
                        heard(item)
                    except Exception as error:  # noqa: BLE001 - logged there
                        self._failures.note(heard, item, error)

    def close(self) -> None:
        """End every viewer."""
        for feed in tuple(self._feeds):
            feed.close()
