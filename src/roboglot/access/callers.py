"""Parsing of a client's address, and of the header with its name. Knows no rights."""

from __future__ import annotations

import base64


def host_of(address: str) -> str:
    """Return the host of "10.0.0.7:40312" or "[::1]:40312", also with gRPC's prefix "ipv4:" or "ipv6:"."""
    text = address.removeprefix("ipv4:").removeprefix("ipv6:").replace("%5B", "[").replace("%5D", "]")
    return text.rpartition(":")[0].strip("[]").removeprefix("::ffff:")


def port_of(address: str) -> int:
    """Return the port at the end of an address; 0 if there is none."""
    port = address.rpartition(":")[2]
    return int(port) if port.isascii() and port.isdecimal() else 0


def basic_of(value: str) -> tuple[str, str]:
    """Return name and password of a header "Basic …"; empty texts for any other header."""
    scheme, _, rest = value.partition(" ")
    if scheme.lower() != "basic":
        return "", ""
    try:
        name, _, password = base64.b64decode(rest.strip(), validate=True).decode().partition(":")
    except ValueError:  # no base64, or no text in it
        return "", ""
    return name, password
