"""People whom the robot knows (members), with faceprints and voiceprints."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from roboglot.model.components.component import Component
from roboglot.values import dataclass

MEMBERS_MAX = 100
NAME_MAX = 64  # characters
PRINT_MAX = 64 * 1024  # bytes of a face's or a voice's print


@dataclass(frozen=True, slots=True)
class Member:
    """``face`` and ``voice``: a recogniser's prints, opaque here; None: not enrolled. ``host``: the owner."""

    id: int
    name: str
    host: bool = False
    face: bytes | None = None
    voice: bytes | None = None


class Members(Component):
    """Members by name. An acknowledged change survives a crash and publishes ``MembersChanged``."""

    @abstractmethod
    def all(self) -> Sequence[Member]:
        """Members in the order in which they were added."""

    @abstractmethod
    def get(self, name: str) -> Member:
        """Return a member. Raises NotFound."""

    @abstractmethod
    async def add(self, name: str, *, host: bool = False) -> Member:
        """Add a member. Raises InvalidGoal for an empty, long or taken name, or beyond MEMBERS_MAX."""

    @abstractmethod
    async def rename(self, name: str, new: str) -> Member:
        """Rename a member. Raises NotFound, and InvalidGoal as ``add`` does."""

    @abstractmethod
    async def remove(self, name: str) -> None:
        """Remove a member with face and voice. Raises NotFound."""

    @abstractmethod
    async def set_face(self, name: str, face: bytes | None) -> Member:
        """Store a faceprint, or delete it (None). Raises NotFound, and InvalidGoal if it is too large."""

    @abstractmethod
    async def set_voice(self, name: str, voice: bytes | None) -> Member:
        """Store a voiceprint, or delete it (None). Raises as ``set_face`` does."""
