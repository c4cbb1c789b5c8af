"""Access for developers, which a key from the maker opens."""

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
        """Fetch the key that lies at ``link`` and open the access.

        Raises InvalidGoal for what is no link, Refused when the internet is not reached, and NotFound when the key is
        another robot's.
        """
