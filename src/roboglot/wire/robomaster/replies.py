"""Answers of the robot, word for word, in the forms of its firmware builds.

A profile is one row of a table: the ends of texts. ``SPEC`` follows the published text, with two exceptions that every
known client needs: three decimals, and no ``;`` after the broadcast address.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from roboglot.values import dataclass


class Reply(StrEnum):
    """Fixed answers, without their ends."""

    OK = "ok"
    FAIL = "fail"
    NOT_IN_SDK_MODE = "not in sdk mode"
    ALREADY_IN_SDK_MODE = "Already in SDK mode"
    QUIT_FAILED = "quit sdk mode failed"
    PARSE_ERROR = "command format error: command parse error"
    SEQ_ERROR = "command format error: seq parse error"
    NO_SEQ = "command format error: no seq value"


Number = int | float


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Wire format of one build: ends of fixed answers, of answers with values, of pushes and events, of the broadcast.

    ``as_robots``: units, orders and ranges of real robots instead of the manual's; all due pushes of a module then
    share one datagram.
    """

    name: str
    version: str
    result_end: str
    values_end: str
    push_end: str
    broadcast_end: str
    as_robots: bool
    separator: str  # between attributes in one datagram

    def result(self, text: str, seq: int | None = None) -> bytes:
        """Return a fixed answer, or any other single text."""
        return _joined(text, seq, self.result_end)

    def values(self, values: Sequence[Number | str], seq: int | None = None) -> bytes:
        """Return the answer to a query: one value unchanged, several with floats rounded to three decimals."""
        text = str(values[0]) if len(values) == 1 else _numbers(values)
        return _joined(text, seq, self.values_end)

    def push(self, module: str, *attributes: tuple[str, Sequence[Number]], separator: str | None = None) -> bytes:
        """Return one datagram, such as ``chassis push attitude 0.100 1.000 3.000;``, with one or more attributes."""
        between = self.separator if separator is None else separator
        texts = [f"{name} {_numbers(values)}" for name, values in attributes]
        return _joined(f"{module} push {between.join(texts)}", None, self.push_end)

    def event(self, text: str) -> bytes:
        """Return one event, such as ``armor event hit 1 0;``."""
        return _joined(text, None, self.push_end)

    def game(self, numbers: Sequence[int]) -> bytes:
        """Return keys and mouse, such as ``game msg push [0, 6, 1, 0, 0, 255, 1, 87];``, the same in every build."""
        return f"game msg push {list(numbers)};".encode()

    def broadcast(self, address: str) -> bytes:
        """Return the robot's address for clients that search for it, such as ``robot ip 192.168.1.102``."""
        return _joined(f"robot ip {address}", None, self.broadcast_end)


def _numbers(values: Sequence[Number | str]) -> str:
    """Return values with a blank between two; floats have three decimals, and are never ``-0.000``."""
    texts = [f"{value:.3f}" if isinstance(value, float) else str(value) for value in values]
    return " ".join(texts).replace("-0.000", "0.000")


def _joined(text: str, seq: int | None, end: str) -> bytes:
    """Return a text with ``seq`` and a blank before the ``;``, as clients split at blanks and call int()."""
    if seq is None:
        return f"{text}{end}".encode()
    return f"{text} seq {seq}{' ' if end.startswith(';') else ''}{end}".encode()


SPEC = Profile(
    name="spec", version="00.00.00.70", result_end=";", values_end=";", push_end=";", broadcast_end="",
    as_robots=False, separator=";",
)  # fmt: skip
FW60 = Profile(
    name="fw60", version="00.00.00.60", result_end="", values_end=" ", push_end=" ;", broadcast_end="",
    as_robots=True, separator=" ; ",
)  # fmt: skip
FW70 = Profile(
    name="fw70", version="00.00.00.70", result_end=";", values_end=" ;", push_end=" ;;", broadcast_end="",
    as_robots=True, separator=" ; ",
)  # fmt: skip
PROFILES = {profile.name: profile for profile in (SPEC, FW60, FW70)}
