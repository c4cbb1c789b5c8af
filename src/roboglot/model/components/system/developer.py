"""Developer access, which a key from the manufacturer unlocks."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component

LINK_MAX = 2000  # characters


class Developer(Component):
    """Locked as delivered; once unlocked it stays so."""

    @property
    @abstractmethod
    def unlocked(self) -> bool:
        """Current state."""

    @abstractmethod
    async def unlock(self, link: str) -> None:
        """Fetch the key at ``link`` and unlock the access.

        Raises InvalidGoal for a malformed link, Refused without internet access, and NotFound for the key of another
        robot.
        """
