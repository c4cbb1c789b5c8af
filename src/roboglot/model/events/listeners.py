"""Calls listeners of news; one that raises keeps nothing from the others, nor from the one that brings the news."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

log = logging.getLogger(__name__)
T = TypeVar("T")


class Failures:
    """Logs failures of listeners, called in an ``except`` clause: each kind once as an error, again for debugging."""

    def __init__(self) -> None:
        self._logged: set[tuple[str, str, str]] = set()

    def note(self, listener: Callable[..., object], news: object, error: Exception) -> None:
        """Log that ``listener`` raised ``error`` when it got ``news``."""
        kind = _name_of(listener), type(news).__name__, type(error).__name__
        level = logging.DEBUG if kind in self._logged else logging.ERROR
        self._logged.add(kind)
        log.log(level, "listener %s failed at %s: %s", kind[0], kind[1], error, exc_info=error)


def call_all(listeners: list[Callable[[T], None]], news: T, failures: Failures) -> None:
    """Call those that listen now, in order."""
    for listener in tuple(listeners):
        try:
            listener(news)
        except Exception as error:  # noqa: BLE001 - logged there
            failures.note(listener, news, error)


def _name_of(listener: Callable[..., object]) -> str:
    """Return the function's name in the source, for bound and partial ones too."""
    function = getattr(listener, "func", listener)
    return f"{function.__module__}.{getattr(function, '__qualname__', type(function).__qualname__)}"
