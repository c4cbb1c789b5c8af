"""Joins a cluster of Ray, or starts one on this machine that ends with this program. Knows no shards."""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

from roboglot.extras import explaining
from roboglot.hosting.error_text import in_words
from roboglot.shards.ray_processes import NICENESS, children, end_children

TOKENS = "RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH"


def own_token(environment: Mapping[str, str], home: Path) -> bool:
    """Return whether the user has a token for Ray; `ray start --head` then requires it, Ray's client never sends it."""
    return any(map(environment.get, TOKENS)) or (home / ".ray" / "auth_token").is_file()


with explaining("--on", "fleet"):
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # no data leaves the machine unasked
    if own_token(os.environ, Path(os.path.expanduser("~"))):
        os.environ.setdefault("RAY_AUTH_MODE", "token")
    import ray

log = logging.getLogger(__name__)
LOCAL = "local"
NAMESPACE = "roboglot"
PORT_MAX = 65535
PROBE_MAX = 5.0  # s
CLIENT_PORT = 10001  # default port of ray://HOST
STORE_BYTES = 80 << 20  # of a cluster that we start: actors share no objects
STARTS_MAX = 3  # of Ray on this machine
GIVEN_UP = "timed out during startup"  # in Ray's error
TOO_SLOW = "because its agents were not up within 15 s"


def join(where: str) -> None:
    """Start Ray on this machine (``local``) or join a cluster: ``ray://HOST``, ``HOST:PORT`` or ``auto``.

    Raises OSError in one sentence.
    """
    try:
        if where == LOCAL:
            _start_here()
            return
        _refuse_deaf(where)
        address = f"{where}:{CLIENT_PORT}" if where.startswith("ray://") and where.count(":") == 1 else where
        with warnings.catch_warnings(action="ignore"):  # the error has the reason
            ray.init(address=address, namespace=NAMESPACE, log_to_driver=False, configure_logging=False)
    except Exception as error:  # noqa: BLE001 - Ray raises bare ones, too
        lines = str(error).strip().splitlines() or [type(error).__name__]
        why = f"{lines[0]} {lines[-1]}" if lines[0].endswith(":") else lines[0]  # the server's own error is last
        if why.endswith("connection timeout"):
            why = "no Ray head answers there, or it requires a token that this user does not have (RAY_AUTH_TOKEN)"
        raise OSError(f"--on {where}: {why}") from None


def _refuse_deaf(where: str) -> None:
    """Raise OSError if nothing listens at ``ray://HOST`` or HOST:PORT, where Ray would try again for minutes."""
    host, _, port = where.removeprefix("ray://").rpartition(":")
    if where.startswith("ray://") and not host:
        host, port = port, str(CLIENT_PORT)
    if host and port.isascii() and port.isdigit() and int(port) <= PORT_MAX:
        try:
            socket.create_connection((host.strip("[]"), int(port)), PROBE_MAX).close()
        except OSError as error:
            raise OSError(f"no Ray head answers there: {in_words(error)}") from None


def _start_here() -> None:
    """Start Ray on this machine; again if it gives itself up because its agents were slow, for which it has no setting.

    Raises Exception, as Ray does.
    """
    # Ray's own gives its processes hardly any time beside others: a killed shard was away for minutes.
    os.environ.setdefault(NICENESS, "0")
    before = children()
    for start in range(1, STARTS_MAX + 1):
        try:
            ray.init(
                address="local",
                namespace=NAMESPACE,
                include_dashboard=False,
                object_store_memory=STORE_BYTES,
                log_to_driver=False,
                configure_logging=False,
            )
            return
        except Exception as error:
            if GIVEN_UP not in str(error):
                raise
            end_children(but=before)  # it leaves half of them behind
            if start == STARTS_MAX:
                raise OSError(f"this machine is too busy: Ray gave itself up {start} times {TOO_SLOW}") from None
            log.warning("Ray gave itself up %s: starting it again", TOO_SLOW)


@contextmanager
def joined(where: str) -> Iterator[None]:
    """Context in which this program is part of a cluster; one that it started ends with the context.

    Meanwhile Ray prints its reports, such as dumps of its state, on standard error: the output is the caller's.
    """
    with redirect_stdout(sys.stderr):
        join(where)
        try:
            yield
        finally:
            with _undisturbed():
                ray.shutdown()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Context that ignores SIGINT and SIGTERM: a second Ctrl-C would leave processes of Ray behind."""
    before = [(number, signal.signal(number, signal.SIG_IGN)) for number in (signal.SIGINT, signal.SIGTERM)]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
