"""Parses one command text into words, parameters and sequence number.

``chassis move x 0.5 wait_for_complete true seq 3`` has the command's words, parameters by key in any order, and last
the number that the reply repeats. Knows no list of commands: the caller provides names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from roboglot.values import dataclass
from roboglot.wire.robomaster.replies import Reply

SEQ_MAX = 2**64 - 1
QUERY = "?"
MISSPELT = "leve"  # the gripper's level in the manual
_INTEGER = re.compile(r"[+-]?[0-9]{1,30}", re.ASCII)
_HEX = re.compile(r"0[xX][0-9a-fA-F]{1,16}", re.ASCII)
_FLOAT = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", re.ASCII)
_WORDS = {"true": True, "True": True, "false": False, "False": False}

Value = int | float | bool | str


class Malformed(ValueError):
    """The text is not a command; ``reply``: the protocol's answer to that."""

    def __init__(self, reply: Reply, why: str) -> None:
        super().__init__(why)
        self.reply = reply

    def why(self) -> str:
        """Return a description of the error."""
        return str(self)


@dataclass(frozen=True, slots=True)
class Command:
    """A parsed text: its words without a closing ``?`` and without the sequence number."""

    words: tuple[str, ...]
    query: bool = False
    seq: int | None = None

    @property
    def keys(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Possible wire names, the longest first, each with the remaining words for parameters."""
        for length in (2, 1):
            if length <= len(self.words):
                name = " ".join(self.words[:length])
                yield f"{name} {QUERY}" if self.query else name, self.words[length:]

    def __str__(self) -> str:
        """Return a text for ``parse``, without its ``;``."""
        seq = () if self.seq is None else ("seq", str(self.seq))
        return " ".join((*self.words, *((QUERY,) if self.query else ()), *seq))


def parse(text: str) -> Command:
    """Parse ``text`` (one command without its ``;``). Raises Malformed, also for a bad sequence number."""
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
    """Return the number in the first of ``words``; the robot ignores the others. Raises Malformed."""
    if not words:
        raise Malformed(Reply.NO_SEQ, "seq without a number")
    number = value_of(words[0])
    if type(number) is not int or not 0 <= number <= SEQ_MAX:
        raise Malformed(Reply.SEQ_ERROR, f"seq takes a number from 0 to {SEQ_MAX}, not {words[0]!r}")
    return number


def value_of(word: str) -> Value:
    """Return a parameter's word as int (``2.0`` and 0x…, too), bool or float by its form, otherwise unchanged."""
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
    """Return the values in ``words`` for an operation with parameters ``names``, of which ``bare`` need no name.

    A name takes the next word; its value is an empty word if that is a name itself or missing. Of repeated names the
    last one counts. Remaining words go to the bare parameters, the last words if there are too many (so the number
    counts in ``leve 1``); all others are ignored, as on real robots.
    """
    values, left = _named(words, names)
    empty = [name for name in bare if name not in values]
    for name, word in zip(empty, left[-len(empty) :], strict=False):
        values[name] = value_of(word)
    return values


def ignored_words(words: Sequence[str], names: Sequence[str], bare: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the words that ``parameters_of`` ignores, except ``leve``, a misspelling in the manual."""
    values, left = _named(words, names)
    taken = sum(name not in values for name in bare)
    return tuple(word for word in left[: max(0, len(left) - taken)] if word != MISSPELT)


def _named(words: Sequence[str], names: Sequence[str]) -> tuple[dict[str, Value], list[str]]:
    """Return the values behind ``names``, and the remaining words."""
    values: dict[str, Value] = {}
    left: list[str] = []
    rest = list(reversed(words))
    while rest:
        word = rest.pop()
        if word in names:
            values[word] = value_of(rest.pop()) if rest and rest[-1] not in names else ""
        else:
            left.append(word)
    return values, left
