"""Table of this door: commands by their key, and the messages that it sends. The chapters fill it."""

from __future__ import annotations

from roboglot.operations import OperationTable
from roboglot.wire.contracts import contract

TABLE: OperationTable[str] = OperationTable("robomaster")
SENT = "> "  # the contract's mark of messages that the robot sends unasked
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
)  # those that this door implements


def implemented() -> set[str]:
    """The contract's keys that this door serves wholly, commands and messages."""
    return {row.key for row in contract("robomaster")} & (TABLE.implemented() | MESSAGES)


partly = TABLE.partly


def key_of(message: bytes) -> str:
    """The contract's key of what the robot sends by itself; empty if it is none of it."""
    words = message.split(None, 3)[:3]
    key = SENT + (" ".join(word.decode("ascii", "replace") for word in words[:2]))
    return "> game_msg push" if key == "> game msg" else key if key in MESSAGES else ""
