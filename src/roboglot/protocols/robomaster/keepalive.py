"""Detection, within seconds, of a peer that has vanished silently.

A peer that is alive but does not read keeps its connection. TCP_USER_TIMEOUT would end that, too, so the kernel's
statistics are read instead. The number of lost probes alone proves nothing: a driving client is probed many times a
second.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from ipaddress import ip_address

from roboglot.protocols.robomaster.limits import DEAD_CLIENT_PROBES

_ENDED = (7, 8)  # of enum tcp_state: TCP_CLOSE, TCP_CLOSE_WAIT
_INFO = struct.Struct("=3xB20xI28xI")  # of struct tcp_info
LOOK_PERIOD = 1.0  # s
KERNELS_PROBES = 127  # lost ones after which the kernel itself gives up: as many as it takes


def unanswered(connection: socket.socket) -> tuple[int, int, int]:
    """Return the probes and segments that the peer did not acknowledge, and ms since its last acknowledgement.

    Raises OSError for a closed connection.
    """
    probes, segments, silent = _INFO.unpack(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _INFO.size))
    return probes, segments, silent


def probe_for_life(transport: asyncio.Transport) -> None:
    """Disconnect a dead peer. The kernel knows those on this machine, and probes remote ones."""
    connection = transport.get_extra_info("socket")
    if connection is None:
        return  # a serial line, or a tunnel, which monitors its clients itself
    idle, interval, _ = DEAD_CLIENT_PROBES
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, idle)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, interval)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, KERNELS_PROBES)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 0)
    peer = transport.get_extra_info("peername")
    if peer and not ip_address(peer[0].partition("%")[0]).is_loopback:
        asyncio.get_running_loop().call_later(LOOK_PERIOD, _look, transport, connection)


def _look(transport: asyncio.Transport, connection: socket.socket) -> None:
    """Disconnect a peer that acknowledges neither data nor, without room for data, the kernel's probes."""
    if transport.is_closing():
        return
    idle, interval, count = DEAD_CLIENT_PROBES
    try:
        probes, segments, silent = unanswered(connection)
    except OSError:
        return
    if (probes >= count or segments) and silent >= (idle + interval * count) * 1000:
        transport.abort()
    else:
        asyncio.get_running_loop().call_later(LOOK_PERIOD, _look, transport, connection)


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
