"""Pairing of answers with commands: by ``seq`` where the robot repeats it, else by order. Knows no sockets.

A robot answers each command once and in order, but builds differ in what ends an answer, and the oldest end it with
nothing at all; the next expected number marks the end even there.
"""

from __future__ import annotations

import re
from collections import deque

from roboglot.wire.robomaster.replies import Reply

ANSWER_MAX = 4096  # bytes
_FIXED = frozenset(Reply) | {"error"}
_NUMBERED = re.compile(r"(.*?) ?\bseq (\d{1,20})", re.DOTALL)


class Pairing:
    """Numbers of the unanswered commands, oldest first, and the text received so far."""

    def __init__(self) -> None:
        self._waiting: deque[int] = deque()
        self._bare: set[int] = set()  # those that were sent without a number
        self._text = ""
        self.wordings: dict[int, str] | None = None  # raw answers by number, kept if this is a dict
        self.as_robots = False  # whether an answer had the format of real robots' builds

    def __len__(self) -> int:
        return len(self._waiting)

    def sent(self, number: int, *, bare: bool = False) -> None:
        """Note a sent command with ``seq number``; ``bare``: without it."""
        self._waiting.append(number)
        if bare:
            self._bare.add(number)

    def received(self, data: bytes) -> list[tuple[int, str]]:
        """Return the answers completed by ``data``: each command's number, and its answer without number and end.

        Raises ValueError for an answer of more than ANSWER_MAX bytes.
        """
        self._text = (self._text + data.decode(errors="replace")).lstrip("; \r\n")
        answers = []
        while self._waiting and self._text:
            head, semicolon, tail = self._text.partition(";")
            found = self._ended(head, tail) if semicolon else self._ended_without_semicolon(head)
            if found is None:
                break
            answers += found
            self._text = self._text.lstrip("; \r\n")
        if not self._waiting:
            self._text = ""  # unsolicited
        if len(self._text) > ANSWER_MAX:
            raise ValueError(f"an answer of more than {ANSWER_MAX} bytes")
        return answers

    def _ended(self, head: str, tail: str) -> list[tuple[int, str]]:
        """Return the answer ``head``, which ended with ``;``; nothing if it belongs to no command."""
        self._text = tail
        wording = f"{head};"
        if (found := _NUMBERED.fullmatch(head.strip())) is None:
            self.as_robots = self.as_robots or head.endswith(" ")  # any build may put a blank after a number
            return [(self._keep(self._next(), wording), head.strip())]
        number = int(found[2])
        if number not in self._waiting:
            return []
        while self._next() != number:
            pass  # earlier ones will not be answered any more
        return [(self._keep(number, wording), found[1].strip())]

    def _ended_without_semicolon(self, head: str) -> list[tuple[int, str]] | None:
        """Return an answer that ends without ``;``; None if it is incomplete."""
        answer, mark, rest = head.partition(f" seq {self._waiting[0]}")
        if mark:
            self._text, self.as_robots = rest, True
        elif head.strip() in _FIXED or (self._waiting[0] in self._bare and head.endswith(" ")):
            self._text, self.as_robots = "", True
        else:
            return None
        return [(self._keep(self._next(), answer + mark), answer.strip())]

    def _keep(self, number: int, wording: str) -> int:
        if self.wordings is not None:
            self.wordings[number] = wording
        return number

    def _next(self) -> int:
        number = self._waiting.popleft()
        self._bare.discard(number)
        return number
