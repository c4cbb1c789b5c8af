"""Requests of clients by the contract's keys, and the server's messages that are sent. The chapters fill it."""

from __future__ import annotations

from roboglot.operations import OperationTable

TABLE: OperationTable[str] = OperationTable("foxglove")
SENT = frozenset({"serverInfo", "status", "advertise", "messageData", "time", "parameterValues", "playbackState"})
REFUSALS = frozenset({"serviceCallFailure"})  # the door sends these; there is no other service


def implemented() -> set[str]:
    """Keys of the operations that are there."""
    return {operation.key for operation in TABLE if not operation.partial}


def partly() -> dict[str, str]:
    """Keys of those that are there in part, with what is missing."""
    return {operation.key: operation.partial for operation in TABLE if operation.partial}


class Messages:
    """Messages that the robot sends."""

    @staticmethod
    def implemented() -> set[str]:
        """Keys of ``foxglove_messages``."""
        return {*SENT, *REFUSALS}

    @staticmethod
    def partly() -> dict[str, str]:
        """Return what is sent in part."""
        return {"fetchAssetResponse": "refusals only: there are no files to fetch"}
