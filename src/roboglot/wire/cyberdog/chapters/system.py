"""Chapter "status" on the wire: heartbeats as text, for recordings and other subscribers of the tap.

Heartbeats come twice a second, mostly unchanged: changes are reported at once, unchanged ones now and then.
"""

from __future__ import annotations

import json

from google.protobuf.json_format import MessageToDict, ParseDict, ParseError

from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

HEARTBEAT = "heartbeat"  # name of the operation in the service
LEGS = ("left front", "right front", "left rear", "right rear")  # order of the motors' values
AGAIN = 20  # heartbeats after which an unchanged one is reported again


class Beats:
    """Filter of a robot's heartbeats: passes changes, and every ``AGAIN``-th unchanged one."""

    def __init__(self) -> None:
        self._last = b""
        self._since = 0

    def news(self, ticks: pb.Ticks) -> str:
        """Return the heartbeat as JSON with its field names; empty if it has not changed."""
        data: bytes = ticks.SerializeToString()
        self._since += 1
        if data == self._last and self._since < AGAIN:
            return ""
        self._last, self._since = data, 0
        fields = MessageToDict(ticks, preserving_proto_field_name=True, always_print_fields_with_no_presence=True)
        return json.dumps(fields, ensure_ascii=False, separators=(",", ":"))

    def forget(self) -> None:
        """Forget the last heartbeat, so that the next one is reported; for times without subscribers."""
        self._last = b""


def ticks_of(text: str, address: str) -> pb.Ticks | None:
    """Return a reported heartbeat with ``address`` in place of its own; None for invalid texts."""
    try:
        ticks: pb.Ticks = ParseDict(json.loads(text), pb.Ticks(), ignore_unknown_fields=True)
    except (ParseError, ValueError, RecursionError):
        return None
    ticks.ip = address
    return ticks
