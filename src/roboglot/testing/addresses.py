"""Loopback addresses with every vendor's ports free, and single free ports; each xdist worker has its own."""

from __future__ import annotations

import itertools
import os
import socket
from collections.abc import Iterable

FREE_TRIES = 100
PROBED = (1448, 40923, 50052, 50053)
PORTS = range(20_000, 32_000)
PORT_SHARES = 24  # workers with ports of their own
PORT_STRIDE = 37  # distance between the first ports of processes with the same worker number
_given: set[str] = set()
_ports_given = itertools.count()


def give_back(addresses: Iterable[str]) -> None:
    """Release addresses for other users in this process."""
    _given.difference_update(addresses)


def free_addresses(count: int) -> str:
    """Return the first of ``count`` consecutive loopback addresses whose robot ports are free. Raises OSError."""
    worker = _worker() % 250
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
    """Return a port that is free on every address, for TCP and UDP, and not given out again soon.

    It lies below the system's ports for outgoing connections. Each xdist worker has its own; a process gets
    none twice before it has used all of them. Raises OSError if none is free.
    """
    worker, count = _worker() % PORT_SHARES, len(PORTS) // PORT_SHARES
    for _ in range(count):
        port = PORTS[worker * count + (os.getpid() * PORT_STRIDE + next(_ports_given)) % count]
        if _is_port_free(port):
            return port
    raise OSError(f"none of {count} ports is free")


def _is_port_free(port: int) -> bool:
    with socket.socket() as stream, socket.socket(type=socket.SOCK_DGRAM) as datagrams:
        try:
            stream.bind(("", port))
            datagrams.bind(("", port))
        except OSError:
            return False
    return True


def _worker() -> int:
    """Return the number of this process among xdist's workers."""
    return int("".join(filter(str.isdigit, os.environ.get("PYTEST_XDIST_WORKER", ""))) or 0)
