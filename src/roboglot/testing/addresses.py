"""Loopback addresses with every vendor's ports free, and single free ports; no two processes of a machine share any.

A process claims a block of addresses, and a range of ports, by a name in the kernel, which goes with the process. So
test runs beside each other, and the workers of one run, never meet.
"""

from __future__ import annotations

import itertools
import os
import socket
from collections.abc import Iterable

PROBED = (1448, 40923, 50052, 50053)
BLOCKS = tuple(f"127.{high}.{low}" for high in range(100, 220) for low in range(1, 251))
BLOCK = range(1, 255)
BLOCKS_MAX = 4  # of one process
PORTS = range(20_000, 32_000)
PORT_SHARES = 24
STRIDE = 37  # distance between the first blocks, and the first ports, of processes that follow one another
_given: set[str] = set()
_blocks: list[str] = []
_shares: list[int] = []
_ports_given = itertools.count()


def give_back(addresses: Iterable[str]) -> None:
    """Release addresses for other users in this process."""
    _given.difference_update(addresses)


def free_addresses(count: int) -> str:
    """Return the first of ``count`` consecutive loopback addresses whose robot ports are free. Raises OSError."""
    for number in range(BLOCKS_MAX):
        if number == len(_blocks):
            _blocks.append(BLOCKS[_claim("addresses", len(BLOCKS))])
        for first in range(BLOCK.start, BLOCK.stop - count + 1):
            row = [f"{_blocks[number]}.{first + further}" for further in range(count)]
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

    It lies below the system's ports for outgoing connections. A process gets none twice before it has used all of
    its share. Raises OSError if none is free.
    """
    if not _shares:
        _shares.append(_claim("ports", PORT_SHARES))
    count = len(PORTS) // PORT_SHARES
    for _ in range(count):
        port = PORTS[_shares[0] * count + (os.getpid() * STRIDE + next(_ports_given)) % count]
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


def _claim(kind: str, count: int) -> int:
    """Return a number below ``count`` that no other process has, unless all are taken. It is held until the end."""
    first = os.getpid() * STRIDE % count
    for further in range(count):
        number = (first + further) % count
        claim = socket.socket(socket.AF_UNIX)
        try:
            claim.bind(f"\0roboglot-testing-{kind}-{number}")  # not a file: the kernel forgets it with the process
        except OSError:
            claim.close()
            continue
        claim.detach()
        return number
    return first


def _forget() -> None:
    """Let a fork claim its own."""
    for held in (_given, _blocks, _shares):
        held.clear()


os.register_at_fork(after_in_child=_forget)
