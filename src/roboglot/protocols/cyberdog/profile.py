"""Profiles: the manual or the open-source robot, where they disagree and no answer serves both.

Fields that only one of them has are sent in both profiles: clients ignore fields that they do not know.
"""

from enum import StrEnum


class Profile(StrEnum):
    """The setting ``profile`` of ``[cyberdog]``."""

    SPEC = "spec"
    ROBOT = "robot"
