"""Table of this door: commands by key, and the messages that it sends. The chapters fill it."""

from __future__ import annotations

from roboglot.operations import OperationTable
from roboglot.wire.contracts import contract

TABLE: OperationTable[str] = OperationTable("robomaster")
SENT = "> "  # marks unsolicited messages in the contract
MESSAGES = frozenset(
    {
        "> chassis push",
        "> gimbal push",
        "> armor event",
        "> sound event",
        "> sensor_adapter event",
        "> AI push",
        "> robot ip",
        "> game_msg push",
    }
)  # of those, the implemented ones


def implemented() -> set[str]:
    """Return the contract's keys of complete commands and messages."""
    return {row.key for row in contract("robomaster")} & (TABLE.implemented() | MESSAGES)


partly = TABLE.partly


def key_of(message: bytes) -> str:
    """Return the contract's key of an unsolicited message; empty if it is not in the contract."""
    words = message.split(None, 3)[:3]
    key = SENT + (" ".join(word.decode("ascii", "replace") for word in words[:2]))
    return "> game_msg push" if key == "> game msg" else key if key in MESSAGES else ""
