"""A radio by which robots claim places and announce where they go next."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Sequence

from roboglot.model.components.component import Component
from roboglot.model.geometry import Point, Pose
from roboglot.values import dataclass

CLAIMS_MAX = 200
CLAIM_MAX = 100  # characters
WAY_MAX = 100  # points


@dataclass(frozen=True, slots=True)
class Announcement:
    """A robot's broadcast of its pose and its next metres, in the frame of the map that ``frame`` names.

    ``stamp`` s, ``speed`` m/s, ``radius`` m of its hull. ``way``: its next metres as dense points, up to where it lets
    others pass first; empty for a robot without a goal. A higher ``priority`` goes first. ``inside``: the robot is
    where two cannot pass each other.
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
    """Radio between robots: the last claims and announcement of each are heard by all others in range.

    ``priority``: declared in the configuration, for announcements.
    """

    priority: int = 0

    @property
    @abstractmethod
    def claims(self) -> frozenset[str]:
        """Return the names that this robot claims."""

    @abstractmethod
    def claim(self, names: Collection[str]) -> None:
        """Replace the claims. Raises InvalidGoal for more or longer names than the radio carries."""

    @abstractmethod
    def others(self, name: str) -> int:
        """Return the number of other robots in range that claim ``name``."""

    @abstractmethod
    def announce(self, announcement: Announcement | None) -> None:
        """Set the announcement, or clear it (None). Raises InvalidGoal for a longer way than the radio carries."""

    @abstractmethod
    def heard(self) -> Sequence[Announcement]:
        """Return the last announcements of other robots in range."""
