"""Touch sensors around the hull."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class Bumper(Component):
    """Publishes ``BumperPressed`` and ``BumperReleased``."""

    zones: tuple[str, ...]

    @property
    @abstractmethod
    def pressed(self) -> frozenset[str]:
        """Zones that are touching something."""
