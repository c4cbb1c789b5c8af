"""Record of the traffic with one robot, by keys of the contract. Knows no sockets."""

from __future__ import annotations

from functools import cache

from roboglot.clients.robomaster.calls import REFUSALS
from roboglot.model.tap import LOST, Line
from roboglot.wire.contracts import contract
from roboglot.wire.robomaster.commands import Malformed, parse

BEYOND = frozenset({"version", "version ?"})  # commands that robots know although the manual does not list them


class Noting:
    """Record of one control connection's commands, and of pushes and events."""

    def __init__(self, line: Line) -> None:
        self.line = line
        self._asked: dict[int, tuple[str, float]] = {}

    def sent(self, number: int, command: str) -> None:
        """Record a command."""
        if self.line.watched:
            key = _key(command)
            self._asked[number] = key, self.line.request(key, command)

    def answered(self, number: int, wording: str, answer: str) -> None:
        """Record an answer, raw and parsed."""
        if (asked := self._asked.pop(number, None)) is not None:
            refused = answer if answer in REFUSALS else ""
            self.line.reply(asked[0], wording, refused or "ok", refused, asked[1])

    def lost(self, number: int, why: str) -> None:
        """Record that no answer is expected any more."""
        if (asked := self._asked.pop(number, None)) is not None:
            self.line.reply(asked[0], b"", LOST, why, asked[1])

    def note_push(self, data: bytes) -> None:
        """Record telemetry or an event."""
        if self.line.watched:
            words = " ".join(data.decode("utf-8", "replace").split(None, 2)[:2])
            key = "> game_msg push" if words == "game msg" else f"> {words}"
            self.line.push(key if key in _keys() else "", data)


@cache
def _keys() -> frozenset[str]:
    return BEYOND | {row.key for row in contract("robomaster")}


def _key(command: str) -> str:
    try:
        return next((key for key, _ in parse(command.rstrip(";")).keys if key in _keys()), "")
    except Malformed:
        return ""
