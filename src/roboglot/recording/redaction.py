"""Takes out of messages what must not leave the house: passwords, tokens, Wi-Fi keys, names and faces of people.

Works on bytes: everything else of a message stays as it was, byte for byte. Photos and films of real robots, where
anyone may be seen, keep their size alone.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from roboglot.model.tap import Direction, Exchange

FILES = ("4002", "4004")  # what a dog sends in chunks: photos and films
REDACTED = b"[redacted]"
FIELDS = (
    "password",
    "passwd",
    "pwd",
    "psk",
    "passphrase",
    "wifi_password",
    "wifi_pwd",
    "ssid",
    "token",
    "access_token",
    "refresh_token",
    "secret",
    "authorization",
    "api_key",
    "account",
    "nickname",
    "username",
    "phone",
    "face_name",
    "face_image",
    "face_img",
    "host_face",
)


class Redaction:
    """Replaces the values of ``fields`` (names in JSON, queries and ``name=value``; case does not matter)."""

    def __init__(self, fields: Sequence[str] = FIELDS) -> None:
        names = b"|".join(re.escape(name).encode() for name in fields)
        self._some = re.compile(names, re.IGNORECASE) if fields else None
        # JSON, also inside a JSON string, where each quote is escaped once or more: \1 is the quote in that form.
        self._in_json = re.compile(
            rb'(\\*")(' + names + rb")\1(\s*:\s*)(?:\1.*?(?<!\\)\1|-?[\d.][\d.eE+-]*|\[[^\[\]{}]*\])",
            re.IGNORECASE | re.DOTALL,
        )
        self._in_query = re.compile(rb"([?&; ](?:" + names + rb")=)[^&;\s\"]*", re.IGNORECASE)

    def __call__(self, payload: bytes) -> bytes:
        """Return ``payload`` without what must stay secret."""
        if self._some is None or not self._some.search(payload):
            return payload
        payload = self._in_json.sub(rb"\1\2\1\3\1" + REDACTED + rb"\1", payload)
        return self._in_query.sub(rb"\1" + REDACTED, payload)


def without_picture(exchange: Exchange) -> Exchange:
    """Return an exchange with zeros for the bytes of a photo or film, if it has some."""
    if exchange.direction is not Direction.REPLY or exchange.operation not in FILES or exchange.payload[:1] == b"{":
        return exchange
    if not exchange.door.endswith("cyberdog"):
        return exchange
    from google.protobuf.message import DecodeError

    from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

    try:
        chunk = pb.FileChunk.FromString(exchange.payload)
    except DecodeError:
        return exchange._replace(payload=REDACTED)
    chunk.buffer = bytes(len(chunk.buffer))
    return exchange._replace(payload=chunk.SerializeToString())
