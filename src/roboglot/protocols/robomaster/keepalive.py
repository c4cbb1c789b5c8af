"""Detection, within seconds, of a peer that has vanished silently."""

from __future__ import annotations

import asyncio
import socket

from roboglot.protocols.robomaster.limits import DEAD_CLIENT_PROBES

_ENDED = (7, 8)  # of enum tcp_state: TCP_CLOSE, TCP_CLOSE_WAIT


def probe_for_life(transport: asyncio.Transport) -> None:
    """Enable the kernel's keep-alive probes: a dead peer is disconnected."""
    connection = transport.get_extra_info("socket")
    if connection is None:
        return  # a serial line, or a tunnel, which monitors its clients itself
    idle, interval, count = DEAD_CLIENT_PROBES
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, idle)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, interval)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, count)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, (idle + interval * count) * 1000)


def hung_up(transport: asyncio.Transport) -> bool:
    """Return whether the peer has closed its side, even with unread data. False for a closed or missing connection."""
    connection = transport.get_extra_info("socket")
    if connection is None:
        return bool(transport.get_extra_info("hung_up", False))
    try:
        state = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0]
    except OSError:
        return False
    return state in _ENDED
