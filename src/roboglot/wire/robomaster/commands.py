"""Parses one command text into words, parameters and sequence number.

``chassis move x 0.5 wait_for_complete true seq 3`` is made of the command's words, parameters by key in any order, and
the number to be repeated in the reply, which must come last. Knows no list of commands: the caller brings names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from roboglot.wire.robomaster.replies import Reply

SEQ_MAX = 2**64 - 1
QUERY = "?"
_INTEGER = re.compile(r"[+-]?[0-9]{1,30}", re.ASCII)
_HEX = re.compile(r"0[xX][0-9a-fA-F]{1,16}", re.ASCII)
_FLOAT = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", re.ASCII)
_WORDS = {"true": True, "True": True, "false": False, "False": False}

Value = int | float | bool | str


class Malformed(ValueError):
    """The text is no command; ``reply`` is the protocol's own answer to that."""

    def __init__(self, reply: Reply, why: str) -> None:
        super().__init__(why)
        self.reply = reply

    def why(self) -> str:
        """Description of the error."""
        return str(self)


@dataclass(frozen=True, slots=True)
class Command:
    """A text taken apart: its words without a closing ``?`` and without the sequence number."""

    words: tuple[str, ...]
    query: bool = False
    seq: int | None = None

    @property
    def keys(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """The wire names that this may be, the longest first, each with the words left for parameters."""
        for length in (2, 1):
            if length <= len(self.words):
                name = " ".join(self.words[:length])
                yield f"{name} {QUERY}" if self.query else name, self.words[length:]

    def __str__(self) -> str:
        """The text that ``parse`` reads back, without its ``;``."""
        seq = () if self.seq is None else ("seq", str(self.seq))
        return " ".join((*self.words, *((QUERY,) if self.query else ()), *seq))


def parse(text: str) -> Command:
    """Take ``text`` (one command without its ``;``) apart; Malformed if it is none or has a bad sequence number."""
    if "\n" in text or "\r" in text:
        raise Malformed(Reply.PARSE_ERROR, "there is a line break in it: is a `;` missing?")
    words = text.split()
    seq = None
    if "seq" in words[1:]:
        at = words.index("seq", 1)
        seq = _sequence_number(words[at + 1 :])
        del words[at:]
    query = len(words) > 1 and words[-1] == QUERY
    if query:
        words.pop()
    if not words:
        raise Malformed(Reply.PARSE_ERROR, "there is no command")
    return Command(tuple(words), query, seq)


def _sequence_number(words: Sequence[str]) -> int:
    """The first of ``words``; the robot ignores what follows."""
    if not words:
        raise Malformed(Reply.NO_SEQ, "seq without a number")
    number = value_of(words[0])
    if type(number) is not int or not 0 <= number <= SEQ_MAX:
        raise Malformed(Reply.SEQ_ERROR, f"seq takes a number from 0 to {SEQ_MAX}, not {words[0]!r}")
    return number


def value_of(word: str) -> Value:
    """A parameter's word as what it looks like: whole number (``2.0`` too), 0x…, true/false, float, else the word."""
    if word in _WORDS:
        return _WORDS[word]
    if _HEX.fullmatch(word):
        return int(word, 16)
    if _INTEGER.fullmatch(word):
        return int(word)
    if _FLOAT.fullmatch(word):
        number = float(word)
        return int(number) if number.is_integer() and abs(number) < 2**53 else number
    return word


def parameters_of(words: Sequence[str], names: Sequence[str], bare: Sequence[str] = ()) -> dict[str, Value]:
    """The values in ``words`` for an operation with parameters ``names``, of which ``bare`` need no name.

    A name takes the word after it, unless that is a name itself or there is none; then its value is an empty word. The
    last of two counts. What is left goes to the bare ones, the last words if there are too many of them (so the number
    counts in ``leve 1``); all else is ignored, as the robot does.
    """
    values: dict[str, Value] = {}
    left: list[str] = []
    rest = list(reversed(words))
    while rest:
        word = rest.pop()
        if word in names:
            values[word] = value_of(rest.pop()) if rest and rest[-1] not in names else ""
        else:
            left.append(word)
    empty = [name for name in bare if name not in values]
    for name, word in zip(empty, left[-len(empty) :], strict=False):
        values[name] = value_of(word)
    return values
