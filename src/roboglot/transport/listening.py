"""Opens TCP ports."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import sys
from collections.abc import Callable

SILENT_PROBES = (20, 5, 4)  # s of silence before a probe, s between probes, lost probes that end the connection


async def listen(
    factory: Callable[[], asyncio.Protocol], address: str, port: int, backlog: int = 100
) -> asyncio.Server:
    """Listen at a port. Raises OSError whose ``strerror`` names it, in the same words under each Python and loop."""
    try:
        server = await asyncio.get_running_loop().create_server(factory, address, port, backlog=backlog)
    except OSError as error:
        number = error.errno or errno.EADDRNOTAVAIL  # for which Python 3.13 and later give no number
        place = f"[{address}]:{port}" if ":" in address else f"{address}:{port}"
        if number == errno.EADDRINUSE:
            reason = f"{place} is in use by another program"
        elif number == errno.EADDRNOTAVAIL:
            reason = f"cannot listen on {place}: it is not an address of this machine"
        else:
            why = os.strerror(number) if number > 0 else error.strerror or str(error)
            reason = f"cannot listen on {place}: {why}"
        raise OSError(number, reason) from None
    for listening in server.sockets:
        end_vanished(listening)
    return server


def end_vanished(listening: socket.socket) -> None:
    """Have the kernel end connections to a port whose clients vanished, with or without data for them.

    Accepted connections inherit this, and may change it. Other systems than Linux lack these options.
    """
    if sys.platform != "linux":
        return
    idle, interval, lost = SILENT_PROBES
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, idle)
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, interval)
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, lost)
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 1000 * (idle + interval * lost))
