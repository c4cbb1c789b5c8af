"""Recognises a repeated request although its ids and times differ."""

from __future__ import annotations

import re

from roboglot.values import dataclass

# Values that a client makes up in each session: UUIDs, Unix times; sequence numbers and frame ids in two protocols.
_FRESH = rb"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}|\b1[5-9]\d{8}(?:\d{3}){0,3}\b"
_any = re.compile(_FRESH, re.IGNORECASE)
_text = re.compile(rb"\s+seq\s+\d+")
_frame = re.compile(rb'(?<="id":)\s*"[^"\\]*"|' + _FRESH, re.IGNORECASE)
_BY_DOOR = {"robomaster": _text, "visual": _frame}
_number = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")


@dataclass(frozen=True, slots=True)
class NormalizedRequest:
    """A request without its fresh values (ids, times), and these values in their order."""

    text: str
    fresh: tuple[bytes, ...]


def normal(door: str, payload: bytes) -> NormalizedRequest:
    """Return a request in recognisable form: with ``\\x00`` for fresh values, without sequence numbers of text."""
    pattern = _BY_DOOR.get(door, _any)
    fresh = tuple(match.group() for match in pattern.finditer(payload))
    text = pattern.sub(b"" if pattern is _text else b"\0", payload).decode("utf-8", "backslashreplace")
    return NormalizedRequest(text.strip().rstrip(";").strip(), fresh)


def rewritten(payload: bytes, recorded: tuple[bytes, ...], live: tuple[bytes, ...]) -> bytes:
    """Return a recorded answer with the live client's ids instead of the recorded ones."""
    pairs = {old.strip(): new.strip() for old, new in zip(recorded, live, strict=False) if old.strip() != new.strip()}
    if not pairs:
        return payload
    several = re.compile(b"|".join(rb"(?<![\w-])" + re.escape(old) + rb"(?![\w-])" for old in pairs))
    quoted = re.compile(b"|".join(re.escape(old) for old in pairs))
    pattern = quoted if all(old.startswith(b'"') for old in pairs) else several
    return pattern.sub(lambda match: pairs[match.group()], payload)


def with_seq(answer: bytes, recorded: tuple[bytes, ...], live: tuple[bytes, ...]) -> bytes:
    """Return an answer of the text protocol with a sequence number only if the live command has one."""
    if bool(recorded) == bool(live):
        return answer
    if recorded:
        return re.sub(_text.pattern + rb"( (?=;))?", b"", answer)
    body = answer.rstrip(b" ;")
    end = answer[len(body) :]
    return body + live[0] + (b" " if end.startswith(b";") else b"") + end


def without_numbers(text: str) -> tuple[str, tuple[float, ...]]:
    """Return the text with ``#`` for each number, and the numbers."""
    return _number.sub("#", text), tuple(float(match.group()) for match in _number.finditer(text))
