"""Recognises connections of another protocol (HTTP, TLS, SSH), so that their bytes are never run as commands.

Every page in a browser can send an HTTP request whose body holds commands to ports of this machine.
"""

from __future__ import annotations

import asyncio
import logging
import re

log = logging.getLogger(__name__)

HEAD_MAX = 32  # bytes within which a foreign protocol can be recognized
_TLS = 0x16  # the first byte of a handshake; no command begins with a control character
_METHODS = (
    b"get", b"post", b"put", b"head", b"delete", b"options", b"patch", b"trace", b"connect", b"pri",
)  # fmt: skip
_HTTP = re.compile(rb"[A-Z]{3,20} [/*]|(?i:" + b"|".join(_METHODS) + rb")[ \t]")
_PERHAPS_HTTP = re.compile(rb"[A-Z]{0,20} ?")
_SSH = b"SSH-"


class Greeting:
    """Inspects the first bytes of a connection, which may arrive one by one."""

    __slots__ = ("_head", "known")

    def __init__(self) -> None:
        self._head = b""
        self.known = False  # True once the connection has proved to be a client's

    def check(self, data: bytes) -> bytes:
        """Return the bytes that may be read as this port's own: none while the head could still be a stranger's.

        Raises StrangerError, which names the protocol.
        """
        if self.known:
            return data
        self._head += data
        head = self._head[:HEAD_MAX]
        if protocol := _protocol(head):
            raise StrangerError(protocol)
        if _undecided(head):
            return b""
        self.known, whole, self._head = True, self._head, b""
        return whole


def turn_away_strangers(greeting: Greeting, transport: asyncio.Transport, data: bytes) -> bytes:
    """Return the bytes of ``data`` to be read; disconnect a stranger, with a line in the log."""
    if transport.is_closing():
        return b""
    try:
        return greeting.check(data)
    except StrangerError as error:
        (host, *_), (_, port, *_) = transport.get_extra_info("peername"), transport.get_extra_info("sockname")
        log.warning("robomaster: disconnected %s, which speaks %s on port %d: no command was run", host, error, port)
        transport.abort()
        return b""


class StrangerError(Exception):
    """The connection uses another protocol, which the message names."""


def _protocol(head: bytes) -> str:
    if head[:1] == bytes([_TLS]):
        return "TLS"
    if head.startswith(_SSH):
        return "SSH"
    return "HTTP" if _HTTP.match(head) else ""


def _undecided(head: bytes) -> bool:
    """Return whether further bytes could reveal another protocol."""
    if _SSH.startswith(head) or _PERHAPS_HTTP.fullmatch(head):
        return True
    return any(method.startswith(head.lower()) for method in _METHODS)
