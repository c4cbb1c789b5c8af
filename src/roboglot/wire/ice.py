"""Addresses of this machine that WebRTC offers to the peer."""

from __future__ import annotations

LOOPBACK = {4: "127.0.0.1", 6: "::1"}


def offer_loopback() -> None:
    """Have aioice offer the loopback addresses when this machine has no others; it leaves them out.

    For both ends on one machine without a network: a laptop on an aeroplane, a container, a network namespace. Called
    before a connection is made; calling it again changes nothing.
    """
    from aioice import ice

    found = ice.get_host_addresses
    if found.__module__ == __name__:
        return

    def addresses(use_ipv4: bool, use_ipv6: bool) -> list[str]:
        used = {4: use_ipv4, 6: use_ipv6}
        return found(use_ipv4, use_ipv6) or [address for version, address in LOOPBACK.items() if used[version]]

    ice.get_host_addresses = addresses
