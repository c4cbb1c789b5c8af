"""Requests of fleet control: messages and actions by their names, and the implemented rows of the contract."""

from __future__ import annotations

from typing import Any

from roboglot.operations import OperationTable

TABLE: OperationTable[str] = OperationTable("vda5050")
# The version of an action that only one has, and its scope where it is restricted.
ONLY_IN: dict[str, str] = {
    "initPosition": "v2",
    "initializePosition": "v3",
    "clearInstantActions": "v3",
    "trigger": "v3",
    "retry": "v3",
    "skipRetry": "v3",
    "startHibernation": "v3",
    "stopHibernation": "v3",
    "shutdown": "v3",
}
AT_NODES = frozenset(
    {
        "initPosition",
        "initializePosition",
        "startCharging",
        "stopCharging",
        "waitForTrigger",
        "pick",
        "drop",
        "detectObject",
        "finePositioning",
        "enableMap",
        "deleteMap",
    }
)
# Instant actions that are done at once; at the limit of those under way they help, so they are taken.
PROMPT = frozenset(
    {
        "startPause",
        "stopPause",
        "cancelOrder",
        "stateRequest",
        "factsheetRequest",
        "clearInstantActions",
        "trigger",
        "retry",
        "skipRetry",
        "stopHibernation",
    }
)
INSTANT = PROMPT | {
    "startHibernation",
    "shutdown",
    "logReport",
    "enableMap",
    "deleteMap",
    "initPosition",
    "initializePosition",
    "startCharging",
    "stopCharging",
}
MESSAGES = ("state", "visualization", "connection", "factsheet")
FIELDS = (
    "order.nodes.nodePosition",
    "order.nodes.nodePosition.theta",
    "order.nodes.nodePosition.allowedDeviationXY",
    "order.nodes.actions",
    "order.edges.maximumSpeed",
    "order.edges.maximumHeight",
    "state.loads",
    "state.maps",
    "state.distanceSinceLastNode",
)


implemented, partly = TABLE.implemented, TABLE.partly


class Messages:
    """Messages that the robot sends, and the optional fields that it uses."""

    @staticmethod
    def implemented() -> set[str]:
        """Keys of ``vda5050_messages``."""
        return {*MESSAGES, *FIELDS}

    @staticmethod
    def partly() -> dict[str, str]:
        """Return no rows: none is implemented in part."""
        return {}


def operation_of(name: str, level: str) -> Any:
    """Return the action of this name in this version, or None."""
    return TABLE.get(name) if ONLY_IN.get(name, level) == level else None
