"""Channel options of both ends: the service, ports, names, limits, keepalive."""

from __future__ import annotations

SERVICE = "grpcapi.GrpcApp"
ROBOT_PORT = 50052
APP_PORT = 8981
ROBOT_NAME = "cyberdog2.server"  # the common names in the two certificates
APP_NAME = "cyberdog2.client"

MESSAGE_MAX = 5_242_880  # bytes per message in either direction, at the robot's end
STREAMS_MAX = 256  # concurrent calls per connection
CONNECTIONS_MAX = 512  # per robot: each costs 20 kB before its handshake, and 20 more if that fails
HANDSHAKE_SECONDS_MAX = 5  # after which a silent connection is closed
PUSH_MAX = 4_194_304 - 64  # bytes of text in a push: an app's gRPC takes 4 MiB by default

HEARTBEAT_PERIOD = 0.5  # s
HEARTBEAT_DEADLINE = 2.5  # s
LOST_AFTER = 5.0  # s without a successful heartbeat
PUSH_DEADLINE = 3.0  # s

KEEPALIVE_PERIOD = 1.0  # s between pings
KEEPALIVE_DEADLINE = LOST_AFTER
"""s until unanswered pings or bytes end a connection. The vendor's robots wait 1 s; on bad Wi-Fi that cuts calls."""

Options = list[tuple[str, int | str]]
_LIMITS: Options = [("grpc.max_send_message_length", MESSAGE_MAX), ("grpc.max_receive_message_length", MESSAGE_MAX)]
_KEEPALIVE: Options = [
    ("grpc.keepalive_time_ms", int(1000 * KEEPALIVE_PERIOD)),
    ("grpc.keepalive_timeout_ms", int(1000 * KEEPALIVE_DEADLINE)),
    ("grpc.keepalive_permit_without_calls", 1),
]


def server_options() -> Options:
    """Return options of the robot's server, which does not share its port with a second server."""
    return [
        *_LIMITS,
        *_KEEPALIVE,
        ("grpc.http2.min_ping_interval_without_data_ms", 500),
        ("grpc.max_concurrent_streams", STREAMS_MAX),
        ("grpc.max_allowed_incoming_connections", CONNECTIONS_MAX),
        ("grpc.server_handshake_timeout_ms", 1000 * HANDSHAKE_SECONDS_MAX),
        ("grpc.so_reuseport", 0),
    ]


def client_options(name: str) -> Options:
    """Return options of a channel to the peer certified as ``name`` (ROBOT_NAME or APP_NAME), at any address."""
    return [
        *_LIMITS,
        *_KEEPALIVE,
        ("grpc.ssl_target_name_override", name),
        # Each dial is independent: it inherits neither connection nor back-off from an earlier one.
        ("grpc.use_local_subchannel_pool", 1),
    ]
