"""Reflecting strips as landmarks of the map: recorded while driving, and used by a lost robot to find itself."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class LaserLandmarks(Component):
    """The landmarks themselves are ``Annotations.landmarks``; made of Reflectors, Localization and MapAnnotations."""

    @property
    @abstractmethod
    def updating(self) -> bool:
        """True if new strips are added, and moved ones moved."""

    @abstractmethod
    async def set_updating(self, on: bool) -> None:
        """Switch ``updating``; return once it is on disk."""
