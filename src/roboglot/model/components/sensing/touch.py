"""The touch pad, where people stroke and press the robot."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.components.component import Component


class TouchKind(StrEnum):
    """Kind of a touch."""

    SINGLE = "single"
    DOUBLE = "double"
    LONG = "long"


class Touch(Component):
    """Publishes ``Touched``."""

    @property
    @abstractmethod
    def last(self) -> tuple[float, TouchKind] | None:
        """Time (robot time, s) and kind of the last touch; None before the first."""
