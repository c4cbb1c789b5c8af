"""Limited log lines for events that clients can cause at will: one of a kind in PERIOD seconds."""

from __future__ import annotations

import logging
import time

PERIOD = 10.0  # s
KINDS_MAX = 1024


class LogLimiter:
    """Logs through ``log``; repetitions of a key within PERIOD become debug lines."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._said: dict[str, float] = {}

    def warning(self, key: str, message: str, *values: object) -> None:
        """Warn, once in PERIOD for each ``key``."""
        self._emit(logging.WARNING, key, message, values)

    def error(self, key: str, message: str, *values: object) -> None:
        """Log an error with the traceback at hand, once in PERIOD for each ``key``."""
        self._emit(logging.ERROR, key, message, values, traceback=True)

    def info(self, key: str, message: str, *values: object) -> None:
        """Log an information, once in PERIOD for each ``key``."""
        self._emit(logging.INFO, key, message, values)

    def _emit(self, level: int, key: str, message: str, values: tuple[object, ...], *, traceback: bool = False) -> None:
        now = time.monotonic()
        new = now - self._said.get(key, -PERIOD) >= PERIOD
        if new:
            if len(self._said) >= KINDS_MAX:
                self._said.pop(next(iter(self._said)))
            self._said[key] = now
        self._log.log(level if new else logging.DEBUG, message, *values, exc_info=traceback)
