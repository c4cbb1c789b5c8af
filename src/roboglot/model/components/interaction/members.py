"""The people whom the robot knows: its members, with their faces and voiceprints."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from roboglot.model.components.component import Component

MEMBERS_MAX = 100
NAME_MAX = 64  # characters
PRINT_MAX = 64 * 1024  # bytes of a face's or a voice's print


@dataclass(frozen=True, slots=True)
class Member:
    """``face`` and ``voice``: what a recogniser made of them, opaque here; None: not entered. ``host``: the owner."""

    id: int
    name: str
    host: bool = False
    face: bytes | None = None
    voice: bytes | None = None


class Members(Component):
    """By name. What was acknowledged survives a crash; every change publishes ``MembersChanged``."""

    @abstractmethod
    def all(self) -> Sequence[Member]:
        """Members in the order in which they were added."""

    @abstractmethod
    def get(self, name: str) -> Member:
        """The one, or NotFound."""

    @abstractmethod
    async def add(self, name: str, *, host: bool = False) -> Member:
        """Raises InvalidGoal for a name that is empty, too long or taken, or when there are MEMBERS_MAX."""

    @abstractmethod
    async def rename(self, name: str, new: str) -> Member:
        """Raises NotFound, and InvalidGoal as ``add`` does."""

    @abstractmethod
    async def remove(self, name: str) -> None:
        """With face and voice. Raises NotFound."""

    @abstractmethod
    async def set_face(self, name: str, face: bytes | None) -> Member:
        """Keep a face's print, or forget it. Raises NotFound, and InvalidGoal for one that is too large."""

    @abstractmethod
    async def set_voice(self, name: str, voice: bytes | None) -> Member:
        """Keep a voice's print, or forget it. Raises as ``set_face`` does."""
