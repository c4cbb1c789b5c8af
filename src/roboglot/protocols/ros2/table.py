"""Subscriptions of the robot by the contract's keys, and the topics that it publishes. The chapter fills it."""

from __future__ import annotations

from roboglot.operations import OperationTable

TABLE: OperationTable[str] = OperationTable("ros2")
PUBLISHED = frozenset(
    {"scan", "odom", "tf", "tf_static", "map", "battery_state", "pose", "pressure", "rosout", "image/compressed"}
)


implemented, partly = TABLE.implemented, TABLE.partly


class Messages:
    """Messages that the robot publishes."""

    @staticmethod
    def implemented() -> set[str]:
        """Keys of ``ros2_messages``."""
        return set(PUBLISHED)

    @staticmethod
    def partly() -> dict[str, str]:
        """Return what is published in part."""
        return {"joint_states": "the gimbal alone, of robots that have one"}
