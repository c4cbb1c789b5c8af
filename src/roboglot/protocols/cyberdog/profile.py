"""Where the text and the open-source robot disagree in a way that no answer serves both: which one the door follows.

What only one of them has is answered in both profiles: clients ignore fields that they do not know.
"""

from __future__ import annotations

from enum import StrEnum


class Profile(StrEnum):
    """The setting ``profile`` of ``[cyberdog]``."""

    SPEC = "spec"
    ROBOT = "robot"
