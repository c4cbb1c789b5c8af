"""Where the robot keeps maps, programs and recordings."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class Disk(Component):
    """Its size and what is left, in bytes. Whoever stores something refuses to when nothing is left."""

    @property
    @abstractmethod
    def size(self) -> int:
        """All of it."""

    @property
    @abstractmethod
    def free(self) -> int:
        """What is left."""
