"""Downward sensors that detect drops."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class Cliff(Component):
    """Publishes ``CliffDetected`` and ``CliffCleared``; the robot brakes by itself while one of them sees a drop."""

    zones: tuple[str, ...]

    @property
    @abstractmethod
    def detected(self) -> frozenset[str]:
        """Zones without floor below."""
