"""Files that clients leave with the robot: maps in a vendor's format, update packages. Opaque to the model."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from roboglot.model.components.component import Component

FILE_BYTES_MAX = 256 << 20


class FileStore(Component):
    """Bytes by name ("slamware/map.stcm"). An acknowledged change survives a crash."""

    @abstractmethod
    async def names(self) -> Sequence[str]:
        """Return the names in alphabetical order."""

    @abstractmethod
    async def read(self, name: str) -> bytes:
        """Return a file's bytes. Raises NotFound."""

    @abstractmethod
    async def write(self, name: str, data: bytes) -> None:
        """Store a file, replacing one of that name; return once it is on disk. Raises InvalidGoal if too long."""

    @abstractmethod
    async def remove(self, name: str) -> None:
        """Delete a file. Raises NotFound."""
