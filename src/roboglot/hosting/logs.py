"""Log lines: one per event, on standard error, with the robot's name, and limited in rate by kind."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable

from roboglot.hosting.escaping import VisibleFormatter
from roboglot.model.client_context import concerned
from roboglot.values import dataclass

NOISY = (  # loggers of libraries; those of drivers and doors of others write INFO lines, too
    "uvicorn", "websockets", "httpx", "grpc", "asyncio", "numba", "aioice", "aiortc", "libav", "psycopg", "mcp",
)  # fmt: skip
LINES_MAX = 50  # of a kind about one robot in PERIOD
ALL_LINES_MAX = 250  # of a kind about no single robot: a start logs lines for each of 100 robots
PERIOD = 10.0  # s
KINDS_MAX = 1024
_QUERY = re.compile(r"\?[^\s\"'<>\[\]]+")


@dataclass(slots=True)
class _Window:
    """Number of lines of one kind since ``began`` (s)."""

    began: float
    lines: int = 0
    left_out: int = 0


class BoundsLines(logging.Filter):
    """Drops lines of a kind beyond the limit, as clients can cause them, and logs their number."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._now = now
        self._windows: dict[tuple[str, str, str], _Window] = {}  # by logger, message and robot

    def filter(self, record: logging.LogRecord) -> bool:
        key, now, missing = (record.name, str(record.msg), concerned()), self._now(), 0
        window = self._windows.get(key)
        if window is None or now - window.began >= PERIOD:
            missing = window.left_out if window else 0
            self._windows.pop(key, None)
            if len(self._windows) >= KINDS_MAX:
                del self._windows[next(iter(self._windows))]
            window = self._windows[key] = _Window(now)
        window.lines += 1
        most = LINES_MAX if concerned() else ALL_LINES_MAX
        if window.lines > most:
            window.left_out += 1
            return False
        if missing:
            _append(record, f"; {missing} lines like this were left out before")
        if window.lines == most:
            _append(record, f"; further lines like this are left out for up to {PERIOD:g} s")
        return True


def _append(record: logging.LogRecord, text: str) -> None:
    record.msg, record.args = record.getMessage() + text, None


class HidesQueries(logging.Filter):
    """Cuts the query strings out of libraries' lines: they may hold tokens, codes and passwords."""

    def filter(self, record: logging.LogRecord) -> bool:
        if record.name.partition(".")[0] in NOISY and "?" in (text := record.getMessage()):
            record.msg, record.args = _QUERY.sub("?…", text), None
        return True


class NamesRobot(logging.Filter):
    """Adds the robot's name to lines about a robot that do not contain it."""

    def filter(self, record: logging.LogRecord) -> bool:
        if (robot := concerned()) and (name := f"robot {robot}") not in (text := record.getMessage()):
            record.msg, record.args = f"{name}: {text}", None
        return True


def in_shape(handler: logging.Handler, *, verbose: bool = False) -> logging.Handler:
    """Return a handler that writes lines in our form: escaped, with robots' names, without secrets, limited in rate."""
    handler.setFormatter(VisibleFormatter("%(asctime)s %(levelname)-7s %(message)s  (%(name)s)", "%H:%M:%S"))
    if not verbose:
        handler.addFilter(BoundsLines())
    handler.addFilter(HidesQueries())
    handler.addFilter(NamesRobot())
    return handler


def set_up_logging(verbose: bool) -> None:
    """Set up logging: one readable line per event, on standard error."""
    handler = in_shape(logging.StreamHandler(), verbose=verbose)
    logging.basicConfig(level=logging.DEBUG if verbose else logging.INFO, handlers=[handler])
    for name in NOISY:
        logging.getLogger(name).setLevel(logging.INFO if verbose else logging.WARNING)
