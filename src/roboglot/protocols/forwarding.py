"""Requests that a reverse proxy on this machine passes on for clients on other machines, by the headers it adds.

To the robot, such a client comes from loopback, as this machine's own programs do. Not every proxy adds a header.
"""

from __future__ import annotations

from collections.abc import Iterable
from ipaddress import ip_address

from roboglot.config import is_loopback
from roboglot.model.admission import THROUGH

HEADERS = frozenset({b"x-forwarded-for", b"forwarded", b"x-real-ip"})
UNNAMED = "another machine"  # a proxy may hide its client's address
TEXT_MAX, HOPS_MAX = 2048, 16  # characters and addresses that are read, from the end


def elsewhere_of(values: Iterable[str]) -> str:
    """Return the other machine for which a request is passed on; empty for a request of this one.

    ``values`` of HEADERS, in their order. The last address that is not loopback counts: it was added on this machine,
    while those before it may be the client's own invention.
    """
    for value in reversed(list(values)):
        for hop in reversed(value[-TEXT_MAX:].split(",")[-HOPS_MAX:]):
            address = _address_of(hop)
            if not is_loopback(address):
                return address
    return ""


def caller(peer: str, rows: Iterable[tuple[bytes, bytes]]) -> str:
    """Return who calls from ``peer`` ("127.0.0.1:40312"), by header ``rows``: with the other machine's name before it.

    Nothing that is granted to an address is granted to such a caller: any program here could send the header.
    """
    values = [value.decode("latin-1") for name, value in rows if name in HEADERS]
    elsewhere = elsewhere_of(values) if values and is_loopback(peer.rpartition(":")[0].strip("[]")) else ""
    return f"{elsewhere}{THROUGH}{peer}" if elsewhere else peer


def came_by_tls(rows: Iterable[tuple[bytes, bytes]]) -> bool:
    """Return whether a proxy says, in header ``rows``, that its client's connection is encrypted."""
    for name, value in rows:
        text = value[-TEXT_MAX:].decode("latin-1").rpartition(",")[2].strip().lower()
        if name == b"x-forwarded-proto" and text == "https":
            return True
        if name == b"forwarded" and "proto=https" in (pair.strip().replace('"', "") for pair in text.split(";")):
            return True
    return False


def _address_of(hop: str) -> str:
    """Return the address of one hop: "10.0.0.7", "10.0.0.7:80", "[::1]:80" or one part of Forwarded, "for=…;by=…"."""
    text = hop.strip()
    for pair in text.split(";"):
        key, equals, value = pair.partition("=")
        if equals and key.strip().lower() == "for":
            text = value.strip()
    text = text.strip('"')
    bare, bracket, _ = text.partition("]")
    host = bare.removeprefix("[") if bracket else text.partition(":")[0] if text.count(":") == 1 else text
    try:
        return str(ip_address(host))
    except ValueError:
        return UNNAMED
