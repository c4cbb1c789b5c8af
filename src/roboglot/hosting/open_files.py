"""Limit of open files and connections, and the message when it is reached."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import resource
from typing import Any

log = logging.getLogger(__name__)
WANTED = 65_536
OWN, EACH = 64, 11  # needed by the program and one robot; by each client
MORE = "start fewer robots, or allow more with ulimit -n, LimitNOFILE= of systemd, --ulimit nofile of docker"
PERIOD = 2.0  # s (machine clock) between two checks
SPARE = 3  # files; below this the program is full


def raise_limit() -> None:
    """Raise this process's limit as far as the system allows."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = WANTED if hard == resource.RLIM_INFINITY else min(hard, WANTED)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with contextlib.suppress(ValueError, OSError):  # containers may forbid it
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def shortage(robots: int) -> str:
    """Return why ``robots`` cannot even start (libraries crash without files); empty if they can."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = OWN + robots * EACH
    if limit == resource.RLIM_INFINITY or limit >= needed:
        return ""
    count = "1 robot needs" if robots == 1 else f"{robots} robots need"
    return f"{count} {needed} open files, and this program may have {limit}: {MORE}"


def ran_out(error: BaseException | None) -> bool:
    """Return True if ``error`` or one of its causes is a lack of files."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
            return True
        error = error.__cause__ or error.__context__
    return False


def in_words() -> str:
    """Return the message for a full program."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return (
        f"all {limit} files that this program may have open are in use (a robot needs {EACH}, each client one): {MORE}"
    )


class OpenFiles:
    """Watches a loop's open files; logs one line each time the limit is reached."""

    def __init__(self) -> None:
        self._full = False

    def watch(self, loop: asyncio.AbstractEventLoop) -> None:
        """Check regularly until the loop ends."""
        loop.set_exception_handler(self.explain)
        self._look(loop)

    def explain(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handle exceptions of the loop: a shortage of files here, others as usual."""
        if ran_out(context.get("exception")):
            self._log(full=True)
        else:
            loop.default_exception_handler(context)

    def _look(self, loop: asyncio.AbstractEventLoop) -> None:
        # Beyond the limit, uvloop accepts connections and drops them silently.
        limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        try:
            full = limit != resource.RLIM_INFINITY and len(os.listdir("/proc/self/fd")) >= limit - SPARE
        except OSError as error:
            full = ran_out(error)
        self._log(full=full)
        loop.call_later(PERIOD, self._look, loop)

    def _log(self, *, full: bool) -> None:
        if full and not self._full:
            log.error("dropping new connections: %s", in_words())
        self._full = full
