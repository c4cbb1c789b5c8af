"""States of the link to a real robot."""

from enum import StrEnum


class LinkState(StrEnum):
    """State of the link to a real robot."""

    CONNECTING = "connecting"  # for the first time
    UP = "up"
    LOST = "lost"  # lost after it was up; retried at growing intervals
    CLOSED = "closed"  # permanently
