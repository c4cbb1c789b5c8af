"""Refusals by the robot."""

from __future__ import annotations

from roboglot.clients.errors import RefusedByRobot


class RoboMasterRefused(RefusedByRobot):
    """``code`` and ``words`` are the robot's answer, ``operation`` the command as it was sent."""

    def __init__(self, operation: str, words: str) -> None:
        super().__init__(operation, words, "")
        self.words = words
