"""Addresses that WebRTC offers."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from roboglot.wire.ice import offer_loopback


@pytest.mark.parametrize(("others", "offered"), [([], ["127.0.0.1"]), (["10.0.0.4"], ["10.0.0.4"])])
def test_loopback_is_offered_where_nothing_else_is(monkeypatch, others: list[str], offered: list[str]) -> None:
    from aioice import ice

    offer_loopback()
    offer_loopback()
    adapters = [SimpleNamespace(ips=[SimpleNamespace(ip=ip) for ip in ["127.0.0.1", *others]])]
    monkeypatch.setattr(ice.ifaddr, "get_adapters", lambda: adapters)
    assert ice.get_host_addresses(use_ipv4=True, use_ipv6=False) == offered
