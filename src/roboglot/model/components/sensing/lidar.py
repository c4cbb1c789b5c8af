"""The planar laser scanner."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.sensing import LaserScan


class Lidar(Component):
    """Publishes ``ScanTaken`` after every turn."""

    rate: float  # turns per second

    @property
    @abstractmethod
    def scan(self) -> LaserScan | None:
        """Scan of the last full turn; None before the first."""
