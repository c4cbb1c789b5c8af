"""Alignment square to a flight of stairs."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component

ALIGN_WITH_STAIRS = "align with stairs"  # the name of its actions


class StairDirection(StrEnum):
    """Direction of the flight, seen from the robot."""

    UP = "up"
    DOWN = "down"


class AlignmentStage(StrEnum):
    """Feedback of an alignment: searching the first step, moving to it, aligned."""

    LOOKING = "looking"
    ALIGNING = "aligning"
    ALIGNED = "aligned"


class StairAlignment(Component):
    """Alignment from Base, Odometry and sensors of the ground ahead; climbs nothing."""

    @abstractmethod
    def align(self, direction: StairDirection, *, source: str = "") -> Action:
        """Turn and shift until the first step's edge is square ahead, 0.5 m from base_link.

        Feedback is an ``AlignmentStage``. Raises at once, with no effect: NotFound where a standing robot sees no
        step, Refused where the base would not drive. Aborts with NotFound when it loses sight of it, Expired after too
        long.
        """
