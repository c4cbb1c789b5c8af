"""What people set on the robot once and expect to find again."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from roboglot.model.components.component import Component


class Settings(Component):
    """JSON values by key ("slamware.language"). What was acknowledged survives a crash."""

    @abstractmethod
    def get(self, key: str, default: Any = None) -> Any:
        """The value, or ``default`` if never set."""

    @abstractmethod
    async def put(self, key: str, value: Any) -> None:
        """Set it; returns when it is safe on disk."""
