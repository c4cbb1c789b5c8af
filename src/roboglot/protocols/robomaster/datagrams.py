"""Outgoing UDP, all from the robot's own address: clients check the sender of a datagram."""

from __future__ import annotations

import logging
import socket
from ipaddress import IPv4Address

log = logging.getLogger(__name__)


class Datagrams:
    """A socket that sends or drops, and never waits."""

    def __init__(self, address: str) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        try:
            self._socket.bind((address, 0))
        except OSError as error:
            self._socket.close()
            raise OSError(error.errno, f"cannot send from {address}: {error.strerror}") from None

    def send(self, datagram: bytes, host: str, port: int) -> None:
        """Send to ``host``; silently lost if the network does not take it, like any datagram."""
        try:
            self._socket.sendto(datagram, (host, port))
        except OSError as error:
            log.debug("robomaster: datagram to %s:%d lost: %s", host, port, error)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def broadcast_address(address: str) -> str:
    """Return the broadcast address of the network of ``address``."""
    return "127.255.255.255" if IPv4Address(address).is_loopback else "255.255.255.255"
