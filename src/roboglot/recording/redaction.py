"""Redacts confidential data in messages: passwords, tokens, Wi-Fi keys, names and faces of people.

Fields determine which values are confidential; these are redacted from then on wherever they are quoted
(``secrets.py``). Works on bytes: the rest of a message stays the same, byte for byte. Photos and films of real robots,
which may show anyone, keep only their size.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from urllib.parse import unquote_plus

import msgspec

from roboglot.model.tap import DRIVER, Direction, Exchange
from roboglot.recording.messages import split
from roboglot.recording.secrets import REDACTED, Secrets

FILES = ("4002", "4004")  # what a dog sends in chunks: photos and films
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
# Operations with a person's or network's name in a field that has another meaning elsewhere; by door and key.
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
# \1: what escapes a quote, in JSON inside a JSON string once or more. Looked for from its beginning only, and without
# going back, since a regular expression lets no other thread run: a client's message must not stop the robot.
_TEXT = rb".*?(?<!\\)(?:\1\\\1\\)*"  # to its end, with the escaped backslashes there
_listed = re.compile(rb'(?<!\\)(\\{0,63})"(mode|describe)\1"\s*:\s*\1"(?P<value>' + _TEXT + rb')\1"', re.DOTALL)
_brace = re.compile(rb"[{}]")
_strings = re.compile(r'"(?:[^"\\]|\\.)*+"', re.DOTALL)
_parse = msgspec.json.Decoder().decode


class Redaction:
    """Replaces the values of ``fields`` (names in JSON, queries and ``name=value``; case does not matter)."""

    def __init__(self, fields: Sequence[str] = FIELDS, secrets: Secrets | None = None) -> None:
        """``secrets``: known values, of another redaction of the same session."""
        self._fields = tuple(fields)
        self._secrets = Secrets(frozenset(map(str.lower, fields))) if secrets is None else secrets
        self._more: dict[tuple[str, str], Redaction] = {}  # by door and operation
        names = b"|".join(re.escape(name).encode() for name in fields)
        # Looked for one by one: an expression with all of them takes ten times as long, and no thread runs meanwhile.
        low = {field.encode().lower() for field in fields}  # bytes of letters beyond ASCII have no other case
        self._names = sorted(name for name in low if not any(other in name for other in low - {name}))
        # JSON, also inside a JSON string, where each quote is escaped once or more.
        self._in_json = re.compile(
            rb'(?<!\\)(\\{0,63})"('
            + names
            + rb')\1"(\s*:\s*)(?P<value>\1"'
            + _TEXT
            + rb'\1"|-?[\d.][\d.eE+-]*|\[[^\[\]{}]*\])',
            re.IGNORECASE | re.DOTALL,
        )
        self._in_query = re.compile(rb"([?&; ](?:" + names + rb")=)(?P<value>[^&;\s\"]*)", re.IGNORECASE)

    def __call__(self, payload: bytes) -> bytes:
        """Return ``payload`` with secrets redacted."""
        low = payload.lower()
        if self._names and b"describe" in low:
            payload = self._without_people(payload)
        for name in self._names:
            if name in low:
                payload = self._without(payload)
                break
        return self._secrets.without(payload)

    def text(self, text: str) -> str:
        """Return a line of text without known secrets."""
        return self._secrets.without(text.encode("utf-8", "surrogatepass")).decode("utf-8", "surrogatepass")

    def _without(self, payload: bytes) -> bytes:
        def in_json(found: re.Match[bytes]) -> bytes:
            slashes, name, colon, value = found.group(1, 2, 3, "value")
            self._learn(slashes, value)
            quote = slashes + b'"'
            return b"".join((quote, name, quote, colon, quote, REDACTED, quote))

        def in_query(found: re.Match[bytes]) -> bytes:
            self._secrets.learn(unquote_plus(found["value"].decode("utf-8", "replace")))
            return found[1] + REDACTED

        return self._in_query.sub(in_query, self._in_json.sub(in_json, payload))

    def _learn(self, slashes: bytes, value: bytes) -> None:
        """Learn a value of JSON: a string, or the strings of a list; ``slashes`` escape its quotes."""
        text = value.decode("utf-8", "replace")
        try:
            for _ in range((len(slashes) + 1).bit_length() - 1):  # JSON inside of JSON, so many times
                text = json.loads(f'"{text}"')
            for one in _strings.findall(text):
                self._secrets.learn(json.loads(one))
        except ValueError:  # no JSON; its bytes are left out all the same
            return

    def _without_people(self, payload: bytes) -> bytes:
        """Return ``payload`` without the descriptions of people."""
        fields, field = list[re.Match[bytes]](), _listed.search(payload)
        while field is not None:
            fields.append(field)
            field = _listed.search(payload, field.start("value"))  # also inside of it
        descriptions = [one for one in fields if one[2] == b"describe"]
        people = _people_by_structure(payload, len(descriptions))
        if people is None:
            hidden = _people_by_place(fields, payload)
        else:
            hidden = [one for one, is_person in zip(descriptions, people, strict=True) if is_person]
        parts, rest = list[bytes](), 0
        for one in sorted(hidden, key=lambda one: one.span("value")):
            begin, end = one.span("value")
            self._learn(one[1], b'%b"%b%b"' % (one[1], one["value"], one[1]))
            if begin >= rest:  # not inside of another
                parts += payload[rest:begin], REDACTED
                rest = end
        return b"".join((*parts, payload[rest:]))

    def of(self, door: str, operation: str) -> Redaction:
        """Return the redaction of an operation's payloads at a door, or at the driver of such robots."""
        key = door.removeprefix(DRIVER), operation
        if key not in FIELDS_OF:
            return self
        if key not in self._more:
            self._more[key] = Redaction((*self._fields, *FIELDS_OF[key]), self._secrets)
        return self._more[key]

    def exchange(self, exchange: Exchange) -> Exchange:
        """Return an exchange with secrets redacted."""
        payload = self.of(exchange.door, exchange.operation)(exchange.payload)
        refusal = self.text(exchange.refusal) if exchange.refusal else ""
        if _is_refused(exchange) and (exchange.door.removeprefix(DRIVER), exchange.operation) in QUOTING:
            payload = _quoted_in_json.sub(REDACTED, payload)  # a REST refusal quotes it in its body, too
            refusal = _quoted.sub(REDACTED.decode(), refusal)
        return exchange._replace(payload=payload, refusal=refusal)

    def action(self, value: dict[str, object]) -> dict[str, object]:
        """Return an action's state without the name of a Wi-Fi."""
        goal, reason = str(value["goal"]), str(value["reason"])
        if value["name"] not in NAMING or not goal:
            return value
        self._secrets.learn(goal)
        hidden = REDACTED.decode()
        return value | {"goal": hidden, "reason": reason.replace(goal, hidden)}


def _is_refused(exchange: Exchange) -> bool:
    """Return True for a refusal; that of a real robot is known by its status alone."""
    if exchange.refusal:
        return True
    return exchange.direction is Direction.REPLY and exchange.status.startswith(("4", "5", "error"))


def _people_by_structure(payload: bytes, count: int) -> list[bool] | None:
    """Return True for each of ``count`` descriptions that is a person's, in their order; None if that is not JSON."""
    found: list[bool] = []
    try:
        _walk(_parse(split(payload)[1]), found)
    except (msgspec.DecodeError, RecursionError):
        return None
    return found if len(found) == count else None


def _walk(value: object, found: list[bool]) -> None:
    """Look through JSON, and through JSON inside its strings."""
    if isinstance(value, dict):
        is_person = str(value.get("mode", "")).encode("utf-8", "replace") in PEOPLE
        for key, item in value.items():
            if key == "describe" and isinstance(item, str):
                found.append(is_person)
            _walk(item, found)
    elif isinstance(value, list):
        for item in value:
            _walk(item, found)
    elif isinstance(value, str) and value.lstrip()[:1] in ("{", "["):
        try:
            inner = _parse(value)
        except msgspec.DecodeError:
            return
        _walk(inner, found)


def _people_by_place(fields: Sequence[re.Match[bytes]], payload: bytes) -> list[re.Match[bytes]]:
    """Return people's descriptions in text other than JSON: in one object (no brace between), fields in any order."""
    objects: dict[bytes, list[list[re.Match[bytes]]]] = {}  # by their form of quotes
    for field in fields:
        found = objects.setdefault(field[1], [])
        if not found or _brace.search(payload, found[-1][-1].end(), field.start()):
            found.append([])
        found[-1].append(field)
    return [
        one
        for found in objects.values()
        for group in found
        if any(one[2] == b"mode" and one["value"] in PEOPLE for one in group)
        for one in group
        if one[2] == b"describe"
    ]


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
