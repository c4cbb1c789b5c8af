"""Confidential values of a session, known from its fields: text that quotes them later is redacted, too.

A robot's refusal names the requested network, and a log the person who was greeted; their words are the
vendor's, so no field says where the name is.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from urllib.parse import quote, quote_plus

REDACTED = b"[redacted]"
KNOWN_MAX = 200  # values; then a new one takes the place of the oldest
FEW = 50  # forms that are looked for one by one
LONGEST = 256  # characters of one
SHORTEST = 3  # characters, in ASCII; a Chinese name has two
ORDINARY = frozenset(  # values that say nothing, and stand in many messages
    {"admin", "default", "error", "false", "guest", "none", "null", "ok", "redacted", "[redacted]", "roboglot", "root"}
    | {"success", "test", "true", "unknown", "user"}
)
ESCAPES = (b"\\n", b"\\r", b"\\t")  # end in a letter that belongs to no word


class Secrets:
    """Values that were redacted so far; ``fields``: names of fields, which are not secrets."""

    def __init__(self, fields: frozenset[str] = frozenset()) -> None:
        self._public = ORDINARY | fields
        self._known: dict[str, set[bytes]] = {}  # forms by value, the oldest first
        self._by_start: dict[tuple[int, ...], list[bytes]] = {}  # all forms by their first bytes
        self._count = 0  # of forms

    def learn(self, text: str) -> None:
        """Redact this value from now on, if it identifies a person or a network."""
        shortest = SHORTEST if text.isascii() else 2
        if not shortest <= len(text) <= LONGEST or text in self._known or text.strip().lower() in self._public:
            return
        if not any(map(str.isalnum, text)):
            return
        if len(self._known) >= KNOWN_MAX:
            self._forget(next(iter(self._known)))
        self._known[text] = _forms(text)
        self._count += len(self._known[text])
        for form in self._known[text]:
            self._by_start.setdefault(_start(form), []).append(form)

    def _forget(self, text: str) -> None:
        for form in self._known.pop(text):
            alike = self._by_start[_start(form)]
            alike.remove(form)
            self._count -= 1
            if not alike:
                del self._by_start[_start(form)]

    def without(self, payload: bytes) -> bytes:
        """Return ``payload`` without the known values; bytes that are not text stay."""
        forms = {form for start in self._starts(payload) for form in self._by_start[start] if form in payload}
        return _replaced(payload, forms) if forms else payload

    def _starts(self, payload: bytes) -> Iterable[tuple[int, ...]]:
        """Return the first bytes of forms that may be in ``payload``; few are not compared, which takes longer."""
        if self._count <= FEW:
            return self._by_start
        return set(filter(self._by_start.__contains__, zip(payload, payload[1:], payload[2:], strict=False)))


def _start(form: bytes) -> tuple[int, ...]:
    return tuple(form[:SHORTEST])


def _replaced(payload: bytes, forms: Iterable[bytes]) -> bytes:
    try:
        payload.decode()
    except UnicodeDecodeError:
        return payload
    for form in sorted(forms, key=lambda form: (-len(form), form)):  # the longest first
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
