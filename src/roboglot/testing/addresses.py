"""Loopback addresses for robots: of each process and xdist worker its own, with every vendor's ports free."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterable

FREE_TRIES = 100
PROBED = (1448, 40923, 50052, 50053)
_given: set[str] = set()


def give_back(addresses: Iterable[str]) -> None:
    """Let others of this process have them."""
    _given.difference_update(addresses)


def free_addresses(count: int) -> str:
    """Return the first of so many loopback addresses in a row that no one on this machine uses for robots."""
    worker = int("".join(filter(str.isdigit, os.environ.get("PYTEST_XDIST_WORKER", ""))) or 0) % 250
    for attempt in range(FREE_TRIES):
        block = (os.getpid() + 7 * attempt) % 120
        first = 1 + (attempt * 16) % 128
        row = [f"127.{100 + block}.{1 + worker}.{first + number}" for number in range(count)]
        if not _given.intersection(row) and all(map(_is_free, row)):
            _given.update(row)
            return row[0]
    ports = ", ".join(map(str, PROBED))
    raise OSError(
        f"no loopback address is free for robots: something listens on every address at one of the ports {ports}"
    )


def _is_free(address: str) -> bool:
    for port in PROBED:
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address, port))
            except OSError:
                return False
    return True


def free_port() -> int:
    """Return a TCP port of 127.0.0.1 that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
