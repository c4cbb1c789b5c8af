"""Redacts confidential data in messages: passwords, tokens, Wi-Fi keys, names and faces of people.

Works on bytes: the rest of a message stays the same, byte for byte. Photos and films of real robots, which may show
anyone, keep only their size.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from roboglot.model.tap import DRIVER, Direction, Exchange

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
    "nick_name",
    "current_name",
    "wake_name",
    "username",
    "oriname",
    "allfaces",
    "member",
    "pre_name",
    "new_name",
    "voiceprints_data",
    "phone",
    "face_name",
    "face_image",
    "face_img",
    "host_face",
)
# Operations with people's or a network's name in a field that elsewhere says something else; by door and key.
FIELDS_OF = {
    ("cyberdog", "1001"): ("name",),  # of the Wi-Fi
    ("cyberdog", "1021"): ("name",),  # of members
    ("cyberdog", "1023"): ("name",),
}
# Operations whose refusals quote a person's name, or the Wi-Fi's.
QUOTING = {("cyberdog", code) for code in ("1020", "1021", "1022", "1024", "3011", "7001", "7002")} | {
    ("slamware", "PUT /api/core/system/v1/network/status")
}
# Actions whose goal is the name of a Wi-Fi, which their reason may say again.
NAMING = ("join network", "join a network")
_quoted = re.compile(r"(['\"]).*\1", re.DOTALL)
_quoted_in_json = re.compile(rb"'[^\"]*'|\\\".*\\\"", re.DOTALL)
# People in the lists of visual programming, at its own door and inside a dog's 2001: the name is what describes each.
PEOPLE = (b"personnel", b"face", b"voiceprint")  # modes
# \1: what escapes a quote, in JSON inside a JSON string once or more. Looked for from its begin on alone, and without
# going back, since a regular expression lets no other thread run: a client's message must not stop the robot.
_TEXT = rb".*?(?<!\\)(?:\1\\\1\\)*"  # to its end, with the escaped backslashes there
_listed = re.compile(rb'(?<!\\)(\\{0,63})"(mode|describe)\1"\s*:\s*\1"(?P<value>' + _TEXT + rb')\1"', re.DOTALL)
_brace = re.compile(rb"[{}]")


class Redaction:
    """Replaces the values of ``fields`` (names in JSON, queries and ``name=value``; case does not matter)."""

    def __init__(self, fields: Sequence[str] = FIELDS) -> None:
        self._fields = tuple(fields)
        self._more: dict[tuple[str, str], Redaction] = {}  # by door and operation
        names = b"|".join(re.escape(name).encode() for name in fields)
        # Looked for one by one: an expression with all of them takes ten times as long, and no thread runs meanwhile.
        low = {field.encode().lower() for field in fields}  # bytes of letters beyond ASCII have no other case
        self._names = sorted(name for name in low if not any(other in name for other in low - {name}))
        # JSON, also inside a JSON string, where each quote is escaped once or more.
        self._in_json = re.compile(
            rb'(?<!\\)(\\*)"(' + names + rb')\1"(\s*:\s*)(?:\1"' + _TEXT + rb'\1"|-?[\d.][\d.eE+-]*|\[[^\[\]{}]*\])',
            re.IGNORECASE | re.DOTALL,
        )
        self._in_query = re.compile(rb"([?&; ](?:" + names + rb")=)[^&;\s\"]*", re.IGNORECASE)

    def __call__(self, payload: bytes) -> bytes:
        """Return ``payload`` with secrets redacted."""
        low = payload.lower()
        if self._names and b"describe" in low:
            payload = _without_people(payload)
        for name in self._names:
            if name in low:
                return self._without(payload)
        return payload

    def _without(self, payload: bytes) -> bytes:
        payload = self._in_json.sub(rb'\1"\2\1"\3\1"' + REDACTED + rb'\1"', payload)
        return self._in_query.sub(rb"\1" + REDACTED, payload)

    def of(self, door: str, operation: str) -> Redaction:
        """Return the redaction of an operation's payloads at a door, or at the driver of such robots."""
        key = door.removeprefix(DRIVER), operation
        if key not in FIELDS_OF:
            return self
        if key not in self._more:
            self._more[key] = Redaction((*self._fields, *FIELDS_OF[key]))
        return self._more[key]

    def exchange(self, exchange: Exchange) -> Exchange:
        """Return an exchange with secrets redacted."""
        payload = self.of(exchange.door, exchange.operation)(exchange.payload)
        if exchange.refusal and (exchange.door.removeprefix(DRIVER), exchange.operation) in QUOTING:
            payload = _quoted_in_json.sub(REDACTED, payload)  # a REST refusal quotes it in its body, too
            return exchange._replace(payload=payload, refusal=_quoted.sub(REDACTED.decode(), exchange.refusal))
        return exchange._replace(payload=payload)

    def action(self, value: dict[str, object]) -> dict[str, object]:
        """Return an action's state without the name of a Wi-Fi."""
        goal, reason = str(value["goal"]), str(value["reason"])
        if value["name"] not in NAMING or not goal:
            return value
        hidden = REDACTED.decode()
        return value | {"goal": hidden, "reason": reason.replace(goal, hidden)}


def _without_people(payload: bytes) -> bytes:
    """Return ``payload`` without what describes a person: in one object (no brace between), fields in any order."""
    objects: dict[bytes, list[list[re.Match[bytes]]]] = {}  # by their form of quotes
    field = _listed.search(payload)
    while field is not None:
        found = objects.setdefault(field[1], [])
        if not found or _brace.search(payload, found[-1][-1].end(), field.start()):
            found.append([])
        found[-1].append(field)
        field = _listed.search(payload, field.start("value"))  # also inside of it
    spans = [
        one.span("value")
        for found in objects.values()
        for fields in found
        if any(one[2] == b"mode" and one["value"] in PEOPLE for one in fields)
        for one in fields
        if one[2] == b"describe"
    ]
    parts, rest = list[bytes](), 0
    for begin, end in sorted(spans):
        if begin >= rest:  # not inside of another
            parts += payload[rest:begin], REDACTED
            rest = end
    return b"".join((*parts, payload[rest:]))


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
