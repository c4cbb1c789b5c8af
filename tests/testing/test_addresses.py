"""Addresses and ports for tests are those of one process alone."""

from __future__ import annotations

import socket
from ipaddress import ip_address

import pytest

from roboglot.testing import addresses


def test_two_processes_share_no_address_or_port(monkeypatch: pytest.MonkeyPatch) -> None:
    given = [(addresses.free_addresses(3), addresses.free_port())]
    for name in ("_given", "_blocks", "_shares"):  # the kernel holds our claims, as it does another process's
        monkeypatch.setattr(addresses, name, type(getattr(addresses, name))())
    given.append((addresses.free_addresses(3), addresses.free_port()))
    blocks, ports = zip(*given, strict=True)
    assert len({address.rpartition(".")[0] for address in blocks}) == 2
    size = len(addresses.PORTS) // addresses.PORT_SHARES
    assert len({(port - addresses.PORTS.start) // size for port in ports}) == 2


def test_addresses_in_a_row_are_free() -> None:
    first = addresses.free_addresses(2)
    with socket.create_server((str(ip_address(first) + 2), addresses.PROBED[0])):
        further = addresses.free_addresses(2)
    assert ip_address(further) == ip_address(first) + 3
    addresses.give_back([first, str(ip_address(first) + 1)])
    assert addresses.free_addresses(2) == first
    addresses.give_back(str(ip_address(start) + number) for start in (first, further) for number in range(2))
