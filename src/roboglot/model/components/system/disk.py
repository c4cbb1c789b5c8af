"""Disk space for maps, programs and recordings."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

from roboglot.model.components.component import Component

LOW = 500 * 1000**2  # bytes left from which the space counts as low


class Disk(Component):
    """The robot's own storage, in bytes. Large users register under a name. Publishes ``DiskLow``."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Total size, bytes."""

    @property
    @abstractmethod
    def free(self) -> int:
        """Free bytes; 0 when the disk is full."""

    @property
    @abstractmethod
    def uses(self) -> Mapping[str, int]:
        """Return the bytes of each use, by name."""

    @abstractmethod
    def take(self, name: str, size: int) -> None:
        """Set the size of a use to ``size`` bytes. Raises Refused if there is no room."""

    @abstractmethod
    def release(self, name: str) -> None:
        """Free the space of a use; no effect if it has none."""
