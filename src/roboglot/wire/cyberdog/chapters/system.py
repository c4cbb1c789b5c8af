"""Chapter "status" on the wire: a heartbeat as text, for those who follow what a robot says.

Heartbeats come twice a second and mostly say the same: they are reported when they say something else, and sometimes.
"""

from __future__ import annotations

import json

from google.protobuf.json_format import MessageToDict, ParseDict, ParseError

from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

HEARTBEAT = "heartbeat"  # the operation; the service's name for it
LEGS = ("left front", "right front", "left rear", "right rear")  # the order of motors' values
AGAIN = 20  # heartbeats after which an unchanged one is reported again


class Beats:
    """Tells which of a robot's heartbeats are news."""

    def __init__(self) -> None:
        self._last = b""
        self._since = 0

    def news(self, ticks: pb.Ticks) -> str:
        """Return the heartbeat as JSON with the names of its fields; empty if it says what the last ones said."""
        data: bytes = ticks.SerializeToString()
        self._since += 1
        if data == self._last and self._since < AGAIN:
            return ""
        self._last, self._since = data, 0
        fields = MessageToDict(ticks, preserving_proto_field_name=True, always_print_fields_with_no_presence=True)
        return json.dumps(fields, ensure_ascii=False, separators=(",", ":"))

    def forget(self) -> None:
        """Forget the last one: no one follows, and the next one is news."""
        self._last = b""


def ticks_of(text: str, address: str) -> pb.Ticks | None:
    """Return a heartbeat that was reported, from another address; None where the text is none."""
    try:
        ticks: pb.Ticks = ParseDict(json.loads(text), pb.Ticks(), ignore_unknown_fields=True)
    except (ParseError, ValueError, RecursionError):
        return None
    ticks.ip = address
    return ticks
