"""Requests of clients by the contract's keys, and the server's messages that are sent. The chapters fill it."""

from __future__ import annotations

from roboglot.operations import OperationTable

TABLE: OperationTable[str] = OperationTable("foxglove", rename="camel")
SENT = frozenset({"serverInfo", "status", "advertise", "messageData", "time", "parameterValues", "playbackState"})
REFUSALS = frozenset({"serviceCallFailure"})  # the door sends these; there is no other service


implemented, partly = TABLE.implemented, TABLE.partly


class Messages:
    """Messages that the robot sends."""

    @staticmethod
    def implemented() -> set[str]:
        """Keys of ``foxglove_messages``."""
        return {*SENT, *REFUSALS}

    @staticmethod
    def partly() -> dict[str, str]:
        """Return the partly sent messages."""
        return {"fetchAssetResponse": "refusals only: there are no files to fetch"}
