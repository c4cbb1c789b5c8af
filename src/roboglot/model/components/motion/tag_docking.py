"""Precise docking at a mark: a printed tag, a board or reflectors seen by lidar, a shelf to lift."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.values import dataclass


class Mark(StrEnum):
    """A mark to dock at, by the sensor that finds it."""

    PRINTED = "printed"  # an AprilTag or QR code, read by the camera
    BOARD = "board"  # a free-standing flat board 0.36 m wide, such as a dock's front, found by its shape in the scan
    REFLECTORS = "reflectors"  # strips that reflect the lidar's light
    SHELF = "shelf"  # four legs with room for the robot between them


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkGoal:
    """From ``start`` (base_link in map), where the mark can be seen ahead, to ``place`` before it.

    ``place``: of base_link in the mark's frame, m: x away from its front, y to the left of who looks at the robot from
    it; None: the hull 10 cm before it. For a shelf it means nothing: there the robot stops under the middle, or with
    ``outside`` m of its hull left out. ``backward``: with its back to the mark; ``turn``: rad, at the end. ``texts``:
    any of these printed tags, empty: whatever is there; ``strips``: how many reflectors belong together. ``lift``:
    raise the jack under the shelf. ``retries``: tries after a failed one.
    """

    mark: Mark
    start: Pose = ORIGIN
    place: Point | None = None
    backward: bool = False
    turn: float = 0.0
    texts: frozenset[str] = frozenset()
    strips: int = 1
    outside: float | None = None
    lift: bool = False
    retries: int = 0


class TagDocking(Component):
    """Built on Navigation, Driving, Odometry and the sensor that sees the mark."""

    @property
    @abstractmethod
    def marks(self) -> frozenset[Mark]:
        """Marks that this robot can dock at."""

    @abstractmethod
    def dock_at(self, goal: MarkGoal, *, source: str = "") -> Action:
        """Dock at a mark. Raises InvalidGoal for impossible marks and places; aborts with NotFound when the mark is not
        seen, Blocked when the robot is held or misses it, and navigation's errors.

        Feedback: "approaching", "looking", "docking", "lifting", "docked".
        """

    @abstractmethod
    def back_off(
        self,
        mark: Mark,
        *,
        distance: float | None = None,
        ahead: bool = False,
        watchful: bool = False,
        source: str = "",
    ) -> Action:
        """Drive straight backwards (``ahead``: forwards) by ``distance`` m; None: until there is room to turn.

        ``watchful``: keep square to the mark while it is seen. A shelf on the jack is set down first. No effect on a
        charging dock. Aborts with Blocked. Feedback: "lowering", "leaving".
        """
