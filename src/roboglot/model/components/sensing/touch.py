"""The touch pad, where people stroke and press the robot."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.components.component import Component


class TouchKind(StrEnum):
    """How it was touched."""

    SINGLE = "single"
    DOUBLE = "double"
    LONG = "long"


class Touch(Component):
    """Publishes ``Touched``."""

    @property
    @abstractmethod
    def last(self) -> tuple[float, TouchKind] | None:
        """When (robot time, s) and how it was touched last; None: never yet."""
