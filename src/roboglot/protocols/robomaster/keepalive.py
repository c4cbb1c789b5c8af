"""Notices within seconds that a peer has vanished without a word."""

from __future__ import annotations

import asyncio
import socket

from roboglot.protocols.robomaster.limits import DEAD_CLIENT_PROBES

_ENDED = (7, 8)  # of enum tcp_state: TCP_CLOSE, TCP_CLOSE_WAIT


def probe_for_life(transport: asyncio.Transport) -> None:
    """Have the kernel ask a silent peer whether it is still there, and give it up if it isn't."""
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
    """Return whether the peer has ended its side, read or not. False without a connection, and for a closed one."""
    connection = transport.get_extra_info("socket")
    if connection is None:
        return bool(transport.get_extra_info("hung_up", False))
    try:
        state = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0]
    except OSError:
        return False
    return state in _ENDED
