"""A radio by which robots announce which places they occupy, and where they go next."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from roboglot.model.components.component import Component
from roboglot.model.geometry import Point, Pose

CLAIMS_MAX = 200
CLAIM_MAX = 100  # characters
WAY_MAX = 100  # points


@dataclass(frozen=True, slots=True)
class Announcement:
    """What a robot tells of itself: where it is and goes next, in the frame of the map that ``frame`` names.

    ``stamp`` s, ``speed`` m/s, ``radius`` m of its hull. ``way``: its next metres, densely, without those that it will
    not drive before others have passed; empty for one that goes nowhere. ``priority``: who has more goes first.
    ``inside``: it is where two robots cannot pass each other.
    """

    robot: str
    frame: str
    stamp: float
    pose: Pose
    speed: float
    radius: float
    priority: int = 0
    way: tuple[Point, ...] = ()
    inside: bool = False


class TrafficRadio(Component):
    """What a robot claims, and what it announced last, is heard by all others in range until it says something else.

    ``priority``: declared in the configuration, for announcements.
    """

    priority: int = 0

    @property
    @abstractmethod
    def claims(self) -> frozenset[str]:
        """What this robot claims."""

    @abstractmethod
    def claim(self, names: Collection[str]) -> None:
        """Claim these and nothing else. Raises InvalidGoal for more or longer ones than the radio carries."""

    @abstractmethod
    def others(self, name: str) -> int:
        """How many robots in range claim this, but for this one."""

    @abstractmethod
    def announce(self, announcement: Announcement | None) -> None:
        """Announce this from now on, or nothing. Raises InvalidGoal for a longer way than the radio carries."""

    @abstractmethod
    def heard(self) -> Sequence[Announcement]:
        """What the others in range announced last."""
