"""Passes on an EP's broadcasts (``robot ip A.B.C.D``, UDP 40926) with the proxy's own address."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable
from ipaddress import IPv4Address

log = logging.getLogger(__name__)
PORT = 40926  # robots broadcast to it
PREFIX = b"robot ip "


class Announcer:
    """Repeats the broadcasts of the robot at ``host`` with ``address`` as the robot's."""

    def __init__(self, host: str, address: str, heard: Callable[[bytes], None]) -> None:
        self._host, self._address, self._heard = host, address, heard
        self._in: asyncio.DatagramTransport | None = None
        self._out: asyncio.DatagramTransport | None = None

    async def open(self) -> None:
        """Listen; if the port is taken, log that clients will not find the robot."""
        loop = asyncio.get_running_loop()
        try:
            self._out, _ = await loop.create_datagram_endpoint(
                asyncio.DatagramProtocol, local_addr=(self._address, 0), allow_broadcast=True
            )
            self._in, _ = await loop.create_datagram_endpoint(
                lambda: _DatagramListener(self.forward), sock=_listening()
            )
        except OSError as error:
            log.warning("cannot pass the robot's broadcasts: UDP %d: %s", PORT, error.strerror)

    def forward(self, data: bytes, sender: str) -> None:
        """Pass one broadcast on, if it is this robot's and has the known form."""
        if sender != self._host or not data.startswith(PREFIX) or self._out is None:
            return
        self._heard(data)
        _, _, rest = data.removeprefix(PREFIX).partition(self._host.encode())
        everyone = "127.255.255.255" if IPv4Address(self._address).is_loopback else "255.255.255.255"
        self._out.sendto(PREFIX + self._address.encode() + rest, (everyone, PORT))

    def close(self) -> None:
        """Close both sockets."""
        for transport in (self._in, self._out):
            if transport is not None:
                transport.close()


def _listening() -> socket.socket:
    """Return a socket for broadcasts that shares its port with clients on this machine."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.setblocking(False)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("", PORT))
    except OSError:
        listener.close()
        raise
    return listener


class _DatagramListener(asyncio.DatagramProtocol):
    """Hands datagrams on with their sender's address."""

    def __init__(self, heard: Callable[[bytes, str], None]) -> None:
        self._heard = heard

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self._heard(data, addr[0])
