"""Subscriptions of the robot by the contract's keys, and the topics that it publishes. The chapter fills it."""

from __future__ import annotations

from itertools import chain

from roboglot.operations import OperationTable
from roboglot.recording.readings import READINGS

TABLE: OperationTable[str] = OperationTable("ros2")
# Kinds of a recording's entries that are published, and the topics of each.
PUBLISHED = {
    "scan": ("scan",),
    "transforms": ("odom", "tf", "tf_static"),
    "pose": ("pose",),
    "grid": ("map",),
    "battery": ("battery_state",),
    "lidar": (),  # limits, in each scan
    **{reading.topic: (reading.topic,) for reading in READINGS},
}
NOT_RECORDED = ("rosout", "image/compressed")  # topics that the door makes itself

implemented, partly = TABLE.implemented, TABLE.partly


class Messages:
    """Messages that the robot publishes."""

    @staticmethod
    def implemented() -> set[str]:
        """Keys of ``ros2_messages``."""
        return {*chain.from_iterable(PUBLISHED.values()), *NOT_RECORDED}

    @staticmethod
    def partly() -> dict[str, str]:
        """Return the partly published topics."""
        return {"joint_states": "the gimbal alone, of robots that have one"}
