"""Keepalive of both ends: a bad line does not end calls before the app counts as lost."""

from __future__ import annotations

import pytest

from roboglot.wire.cyberdog.channel import (
    APP_NAME,
    HEARTBEAT_DEADLINE,
    LOST_AFTER,
    Options,
    client_options,
    server_options,
)


@pytest.mark.parametrize("options", [server_options(), client_options(APP_NAME)], ids=["server", "client"])
def test_connections_bear_as_much_as_heartbeats(options: Options) -> None:
    given = dict(options)
    patience = int(given["grpc.keepalive_timeout_ms"]) / 1000
    assert patience >= LOST_AFTER > HEARTBEAT_DEADLINE
    # gRPC sets TCP_USER_TIMEOUT to it: so many of TCP's retransmissions (0.3 s, doubled) have their answer in time.
    assert patience > 0.3 + 0.6 + 1.2 + 2.4


def test_servers_bear_the_pings_of_our_clients() -> None:
    allowed = int(dict(server_options())["grpc.http2.min_ping_interval_without_data_ms"])
    assert allowed < int(dict(client_options(APP_NAME))["grpc.keepalive_time_ms"])
