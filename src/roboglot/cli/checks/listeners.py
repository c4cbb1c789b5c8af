"""Process that listens on a TCP port of this machine, from /proc. Linux only."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from collections.abc import Iterator
from ipaddress import ip_address
from pathlib import Path

from roboglot.cli.screen import shortened
from roboglot.values import dataclass

LISTENING = "0A"  # of /proc/net/tcp
COMMAND_MAX = 80  # characters shown of a command line


@dataclass(frozen=True, slots=True)
class Holder:
    """A process that holds a port. ``command`` is empty for one of another user."""

    pid: int | None
    command: str

    @property
    def is_roboglot(self) -> bool:
        """True for ``roboglot up`` and other servers of this program."""
        return "roboglot" in self.command

    def __str__(self) -> str:
        return (
            f"{shortened(self.command, COMMAND_MAX)} (process {self.pid})" if self.pid else "a process of another user"
        )


def holder_of(address: str, port: int) -> Holder | None:
    """Return the process that listens on ``address`` or on every address; None if the port is free."""
    inode = _socket_inode(address, port)
    if inode is None:
        return None
    for folder in Path("/proc").glob("[0-9]*/fd"):
        with contextlib.suppress(OSError):
            if any(_links_to(file, inode) for file in folder.iterdir()):
                command = (folder.parent / "cmdline").read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")
                return Holder(int(folder.parent.name), command.strip())
    return Holder(None, "")


def _links_to(file: Path, inode: str) -> bool:
    with contextlib.suppress(OSError):
        return os.readlink(file) == f"socket:[{inode}]"
    return False


def _socket_inode(address: str, port: int) -> str | None:
    wanted = {_as_in_proc(host, port) for host in _bindings(address)}
    for table in ("tcp", "tcp6"):
        with contextlib.suppress(OSError):
            for line in Path("/proc/net", table).read_text().splitlines()[1:]:
                fields = line.split()
                if fields[1] in wanted and fields[3] == LISTENING:
                    return fields[9]
    return None


def _bindings(address: str) -> Iterator[str]:
    """Yield the addresses to which a socket that takes connections to ``address`` may be bound."""
    with contextlib.suppress(OSError, UnicodeError):  # no such name
        for *_, (host, *_) in socket.getaddrinfo(address, None, type=socket.SOCK_STREAM):
            yield str(host)
            if ":" not in str(host):
                yield from ("0.0.0.0", f"::ffff:{host}")  # gRPC's sockets take IPv4 as IPv6
    yield "::"


def _as_in_proc(address: str, port: int) -> str:
    """Return address and port as in /proc/net: words of 32 bits in the machine's byte order."""
    packed = ip_address(address).packed
    words = struct.unpack(f"={len(packed) // 4}I", packed)
    return f"{''.join(f'{word:08X}' for word in words)}:{port:04X}"
