"""Files that clients leave with the robot: maps in a vendor's format, update packages. Opaque to the model."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from roboglot.model.components.component import Component

FILE_BYTES_MAX = 256 << 20


class FileStore(Component):
    """Bytes by name ("slamware/map.stcm"). What was acknowledged survives a crash."""

    @abstractmethod
    async def names(self) -> Sequence[str]:
        """Return the names in alphabetical order."""

    @abstractmethod
    async def read(self, name: str) -> bytes:
        """The file, or NotFound."""

    @abstractmethod
    async def write(self, name: str, data: bytes) -> None:
        """Keep it, in place of one of that name; returns when it is safe on disk. InvalidGoal if it is too long."""

    @abstractmethod
    async def remove(self, name: str) -> None:
        """Forget it, or NotFound."""
