"""Confidential values of a session, known from its fields: whatever quotes them later is redacted, too.

A robot's refusal names the network that was asked for, and a log the person who was greeted; their words are the
vendor's, so no field says where the name is.
"""

from __future__ import annotations

import json
from urllib.parse import quote, quote_plus

REDACTED = b"[redacted]"
KNOWN_MAX = 200  # values
LONGEST = 256  # characters of one
SHORTEST = 3  # characters, in ASCII; a Chinese name has two
ORDINARY = frozenset(  # values that say nothing, and stand in many messages
    {"admin", "default", "error", "false", "guest", "none", "null", "ok", "redacted", "[redacted]", "roboglot", "root"}
    | {"success", "test", "true", "unknown", "user"}
)
ESCAPES = (b"\\n", b"\\r", b"\\t")  # end in a letter that belongs to no word


class Secrets:
    """Values that were redacted so far; ``fields``: names of fields, which are no secrets."""

    def __init__(self, fields: frozenset[str] = frozenset()) -> None:
        self._public = ORDINARY | fields
        self._known: set[str] = set()
        self._forms: list[bytes] = []  # the longest first

    def learn(self, text: str) -> None:
        """Redact this value from now on, if it tells one person or network from another."""
        shortest = SHORTEST if text.isascii() else 2
        if not shortest <= len(text) <= LONGEST or text in self._known or text.strip().lower() in self._public:
            return
        if len(self._known) < KNOWN_MAX and any(map(str.isalnum, text)):
            self._known.add(text)
            self._forms = sorted({*self._forms, *_forms(text)}, key=lambda form: (-len(form), form))

    def without(self, payload: bytes) -> bytes:
        """Return ``payload`` without the known values; bytes that are no text stay."""
        for form in self._forms:
            if form in payload:
                return self._replaced(payload)
        return payload

    def _replaced(self, payload: bytes) -> bytes:
        try:
            payload.decode()
        except UnicodeDecodeError:
            return payload
        for form in self._forms:
            if form in payload:
                payload = _without(payload, form)
        return payload


def _forms(text: str) -> set[bytes]:
    """Return a value as it stands in a text, in JSON, in JSON inside of JSON, and in a query."""
    forms = {text, quote(text), quote(text, safe=""), quote_plus(text)}
    for is_ascii in (True, False):
        once = json.dumps(text, ensure_ascii=is_ascii)[1:-1]
        forms |= {once, json.dumps(once, ensure_ascii=is_ascii)[1:-1]}
    return {form.encode("utf-8", "surrogatepass") for form in forms}


def _without(payload: bytes, form: bytes) -> bytes:
    parts, rest, at = list[bytes](), 0, payload.find(form)
    while at >= 0:
        end = at + len(form)
        if _stands_alone(payload, form, at, end):
            parts += payload[rest:at], REDACTED
            rest = end
        at = payload.find(form, end)
    return b"".join((*parts, payload[rest:]))


def _stands_alone(payload: bytes, form: bytes, at: int, end: int) -> bool:
    """Return False within a longer word or number, and for a field's name."""
    before, after = payload[at - 1 : at] if at else b"", payload[end : end + 1]
    if _is_word(form[:1]) and _is_word(before) and payload[max(at - 2, 0) : at] not in ESCAPES:
        return False
    if _is_word(form[-1:]) and _is_word(after):
        return False
    quoted = before in (b'"', b"'") and after in (b'"', b"'", b"\\")
    if not any(map(str.isalpha, form.decode("utf-8", "replace"))):  # a number is only meant where it is a text
        return quoted
    return not (quoted and form.islower() and payload[end : end + 16].lstrip(b"\\")[1:].lstrip()[:1] == b":")


def _is_word(letter: bytes) -> bool:
    return letter.isalnum() or letter == b"_"
