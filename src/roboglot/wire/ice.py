"""This machine's addresses, as offered to the peer by WebRTC."""

from __future__ import annotations

LOOPBACK = {4: "127.0.0.1", 6: "::1"}


def offer_loopback() -> None:
    """Make aioice offer the loopback addresses if this machine has no others; normally it omits them.

    For both ends on one machine without a network: a laptop on an aeroplane, a container, a network namespace. Call it
    before the first connection; idempotent.
    """
    from aioice import ice

    found = ice.get_host_addresses
    if found.__module__ == __name__:
        return

    def addresses(use_ipv4: bool, use_ipv6: bool) -> list[str]:
        used = {4: use_ipv4, 6: use_ipv6}
        return found(use_ipv4, use_ipv6) or [address for version, address in LOOPBACK.items() if used[version]]

    ice.get_host_addresses = addresses
