"""Following a walking person or a moving object."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point

DISTANCE_MIN, DISTANCE_MAX = 0.5, 5.0  # m


def check_distance(distance: float) -> None:
    """Raise InvalidGoal outside DISTANCE_MIN to DISTANCE_MAX."""
    if not DISTANCE_MIN <= distance <= DISTANCE_MAX:
        raise InvalidGoal(f"the following distance is {DISTANCE_MIN} to {DISTANCE_MAX} m, not {distance}")


class FollowSide(StrEnum):
    """Side of the person to keep to, seen along their walk; beside them means a little behind."""

    BEHIND = "behind"
    LEFT = "left"
    RIGHT = "right"


class Following(Component):
    """Built on Vision or UltraWideband, Lidar and Base; goes around obstacles in between.

    Feedback: "searching" (out of sight: drives to the last place seen), "following" or "waiting" (no way).
    """

    @abstractmethod
    def follow(
        self,
        person: int | None = None,
        *,
        side: FollowSide = FollowSide.BEHIND,
        distance: float = 1.0,
        source: str = "",
    ) -> Action:
        """Follow the ``person`` of that number (None: the nearest one in sight) at ``distance`` m until cancelled.

        Aborts with NotFound when the person is out of sight for too long. InvalidGoal for distances out of 0.5 to 5 m.
        """

    @abstractmethod
    def follow_tag(self, *, side: FollowSide = FollowSide.BEHIND, distance: float = 1.0, source: str = "") -> Action:
        """Follow the person who carries the ultra-wideband tag that the robot is connected to, as above.

        Needs no picture; raises ComponentMissing without UltraWideband.
        """

    @abstractmethod
    def follow_thing(
        self, place: Point, *, side: FollowSide = FollowSide.BEHIND, distance: float = 1.0, source: str = ""
    ) -> Action:
        """Follow whatever stands at ``place`` (base_link, m) now, as above: the lidar alone keeps it in sight.

        Aborts with NotFound also when nothing stands there that is small enough to be one thing.
        """

    @property
    @abstractmethod
    def place(self) -> Point | None:
        """Place where the target was seen last, in the current base_link (m); None without a target."""
