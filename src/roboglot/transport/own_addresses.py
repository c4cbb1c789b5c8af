"""The addresses of this machine, which a program that listens everywhere has. Needs Linux; elsewhere none is found."""

from __future__ import annotations

import fcntl
import socket
import struct
from contextlib import suppress

SIOCGIFADDR = 0x8915  # asks for an interface's IPv4 address
NAME_MAX = 15  # bytes of an interface's name


def own_addresses() -> list[str]:
    """Return the IPv4 address of each network interface that has one."""
    found = list[str]()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # it has none
                answer = fcntl.ioctl(asking, SIOCGIFADDR, struct.pack("256s", name.encode()[:NAME_MAX]))
                found.append(socket.inet_ntoa(answer[20:24]))
    return found
