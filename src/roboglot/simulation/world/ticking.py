"""Ticks of a world between the control of its robots and their own sensing: wheels, people, physics, shared senses.

One kernel does several of them at once (``kernels/ticks.py``), and stops where something is beyond it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from roboglot.kernels import loading
from roboglot.kernels.layouts import (
    COUNT_UNIT,
    DONE,
    DRIVE,
    GIMBALS,
    MEASURED,
    PEOPLE,
    RECKONED,
    SEEN,
    STAGE_UNIT,
    TICKS_UNIT,
    TOUCHED,
    WATCHED,
)
from roboglot.simulation.bodies.hull import STOREY
from roboglot.simulation.bodies.rounds import Rounds
from roboglot.simulation.bodies.sleep import RESTS
from roboglot.simulation.bodies.support import LIFTED
from roboglot.simulation.people.crowd import HABITS, Crowd
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.world.physics import Physics

LEGS = [GIMBALS, TOUCHED, MEASURED, WATCHED, RECKONED]  # stages of parts, as the kernel takes their tables


@dataclass(frozen=True, slots=True)
class Left:
    """Number of ticks begun; the stage at which the last one stopped (DONE: it is over), and that stage's number."""

    ticks: int
    stage: int
    count: int


class Ticking:
    """Ticks of one world. ``seconds``: length of one."""

    def __init__(self, physics: Physics, crowd: Crowd, rounds: Rounds, seconds: float) -> None:
        self._physics, self._crowd, self._rounds, self._seconds = physics, crowd, rounds, seconds
        self._run: Callable[..., int] | None = None
        self._gathered = 0  # count of the rounds from which these are
        self._arrays: tuple[object, ...] = ()
        self._settings: tuple[float, ...] = ()
        self._refresh: list[Callable[[], None]] = []
        self._steps, self._others = 0, physics.rows.others

    def load_kernels(self) -> None:
        """Do several ticks at once from now on, where that is possible; results stay the same, to the last bit."""
        with loading():
            from roboglot.kernels import ticks

        self._run = ticks.run

    @property
    def lean(self) -> bool:
        """True if ``run`` may do the gimbals of the next tick."""
        return self._run is not None and self._physics.glides

    def run(self, ticks: int, number: int, origin: float, *, followed: bool) -> Left:
        """Begin up to ``ticks`` ticks after tick ``number`` (0: one, without the kernel); ``end`` finishes the last.

        ``followed``: shared control of the first one has run; ``origin``: stamp of tick 0, s.
        """
        if not ticks:
            return Left(1, DRIVE, 0)
        if self._gathered != self._rounds.gathered:
            self._gather()
        course = self._physics.course() if self._arrays else None
        if course is None or self._run is None:
            return Left(1, DRIVE, 0) if followed else Left(0, GIMBALS, 0)
        if self._settings[0] != origin:
            self._settings = origin, *self._settings[1:]
        for refresh in self._refresh:
            refresh()
        gliding, sleep, known = course
        answer = self._run(
            *self._arrays,
            self._settings,
            self._steps,
            number,
            ticks,
            followed,
            known and gliding.parted,
            sleep.holds,
            gliding.free,
            self._others,
        )
        begun, rest = divmod(answer, TICKS_UNIT)
        count, rest = divmod(rest, COUNT_UNIT)
        stage, moved = divmod(rest, STAGE_UNIT)
        if begun > (stage == PEOPLE):
            self._physics.moved(awake=bool(moved), known=known)
        return Left(begun, stage, count)

    def _gather(self) -> None:
        """Take the arrays of the robots' parts and of the physics; none if there are parts that the kernel lacks."""
        rounds, self._arrays, course = self._rounds, (), self._physics.course()
        every = [control.leg for control in rounds.controls] + [sense.leg for sense in rounds.senses]
        legs = [leg for leg in every if leg is not None]
        if self._run is None or course is None or [leg.stage for leg in legs] != LEGS or len(legs) < len(every):
            return
        self._gathered = rounds.gathered
        gliding, sleep, _ = course
        tables = self._physics.around_people[0], *(table for leg in legs for table in leg.tables)
        scene, geoms = (self._crowd.table, *gliding.scene), gliding.geoms
        self._arrays = tables, scene, geoms, gliding.state, gliding.servos, sleep.now, sleep.kept
        self._refresh = [leg.refresh for leg in legs if leg.refresh is not None]
        step, *physical = gliding.settings
        limits = self._seconds, step, RESTS, STOREY, LIFTED
        self._settings = 0.0, *limits, *physical, *HABITS, *(number for leg in legs for number in leg.settings)
        self._steps = round(self._seconds / step)

    def end(self, left: Left, stamp: float, after_substep: Callable[[float], None] | None = None) -> None:
        """Complete a tick (stamp, s); ``after_substep``: see ``Physics.step``."""
        stage, count, seconds, physics = left.stage, left.count, self._seconds, self._physics
        if stage == DONE:
            return
        if stage == DRIVE:
            physics.drive(seconds)
        if stage in (DRIVE, PEOPLE):
            self._crowd.walk(seconds, count if stage == PEOPLE else -1)
            physics.step(seconds, after_substep)
        elif stage <= SEEN:
            physics.end(stage, count, seconds)
        for sense in self._rounds.senses:
            if sense.leg is None or sense.leg.stage > stage:
                sense(stamp, seconds)
            elif sense.leg.stage == stage:
                sense.end(count, stamp, seconds)
