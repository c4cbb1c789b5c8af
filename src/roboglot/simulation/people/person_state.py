"""Place and stride of one person, kept in a row of numbers that a kernel may update. World frame, m, rad."""

from __future__ import annotations

from roboglot.kernels.layouts import (
    ACTS,
    PERSON_BODY,
    PERSON_DISTANCE,
    PERSON_FLOOR,
    PERSON_GOAL_X,
    PERSON_IDLE,
    PERSON_SPEED,
    PERSON_STATE,
    PERSON_WAITED,
    PERSON_WALKED,
    PERSON_WIDTH,
    PERSON_X,
    STANDS,
    WAITS,
    WALKS,
)
from roboglot.model.geometry import Pose

STRIDE_MAX = 0.1  # m per tick: more is not a walk


def blank() -> memoryview[float]:
    """Return a row of its own."""
    row: memoryview[float] = memoryview(bytearray(8 * PERSON_WIDTH)).cast("d")
    return row


class PersonState:
    """Numbers of a person. Kernels may update them, so the properties read them each time."""

    def __init__(self, floor: int) -> None:
        self._row = blank()
        self._row[PERSON_STATE], self._row[PERSON_FLOOR] = ACTS, floor
        self._posed: Pose | None = None  # made of the row

    def enter(self, row: memoryview[float], body: int) -> None:
        """Keep the numbers in this row from now on; ``body``: place among the movable bodies of the physics."""
        self._row[PERSON_BODY] = body
        row[:] = self._row
        self._row = row

    @property
    def pose(self) -> Pose:
        """Present pose."""
        x, y, yaw = self._row[PERSON_X : PERSON_X + 3]
        posed = self._posed
        if posed is None or posed.x != x or posed.y != y or posed.yaw != yaw:
            posed = self._posed = Pose(x, y, yaw)
        return posed

    @pose.setter
    def pose(self, pose: Pose) -> None:
        row, self._posed = self._row, pose
        row[PERSON_X], row[PERSON_X + 1], row[PERSON_X + 2] = pose.x, pose.y, pose.yaw

    @property
    def spot(self) -> tuple[float, float]:
        """Present place."""
        return self._row[PERSON_X], self._row[PERSON_X + 1]

    @property
    def walking(self) -> bool:
        """True if they walked in the last tick."""
        return self._row[PERSON_WALKED] != 0.0

    @walking.setter
    def walking(self, walking: bool) -> None:
        self._row[PERSON_WALKED] = float(walking)

    @property
    def way(self) -> float:
        """Metres walked so far."""
        return self._row[PERSON_DISTANCE]

    @way.setter
    def way(self, way: float) -> None:
        self._row[PERSON_DISTANCE] = way

    @property
    def waited(self) -> float:
        """Time for which a robot has been in the way, s."""
        return self._row[PERSON_WAITED]

    @waited.setter
    def waited(self, seconds: float) -> None:
        self._row[PERSON_WAITED] = seconds

    @property
    def idle(self) -> int:
        """Further ticks of a wait, which are counted already."""
        return int(self._row[PERSON_IDLE])

    @idle.setter
    def idle(self, ticks: int) -> None:
        self._row[PERSON_IDLE] = ticks

    def acts(self) -> None:
        """Note that the next tick takes more than a stride or a wait."""
        self._row[PERSON_STATE] = ACTS

    def cease(self) -> None:
        """Note that the present step ends at once."""
        self._row[PERSON_IDLE], self._row[PERSON_STATE] = 0.0, ACTS

    def note_walk(self, to: tuple[float, float], speed: float, seconds: float) -> None:
        """Note a walk to a place at ``speed`` (m/s), unless it is too fast for ticks of ``seconds``."""
        row = self._row
        row[PERSON_GOAL_X], row[PERSON_GOAL_X + 1], row[PERSON_SPEED] = *to, speed
        row[PERSON_STATE] = WALKS if speed * seconds < STRIDE_MAX else ACTS

    def note_pause(self, *, stands: bool) -> None:
        """Note that they do not walk; ``stands``: until an order comes."""
        self._row[PERSON_STATE] = WAITS if self._row[PERSON_IDLE] else STANDS if stands else ACTS
