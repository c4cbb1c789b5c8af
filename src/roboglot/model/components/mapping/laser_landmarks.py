"""Reflecting strips as landmarks of the map: found while driving, and found again by a robot that is lost."""

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
        """Returns when it is safe on disk."""
