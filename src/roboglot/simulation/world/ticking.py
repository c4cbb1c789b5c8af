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
from roboglot.simulation.bodies.sleep import RESTS
from roboglot.simulation.bodies.support import LIFTED
from roboglot.simulation.bodies.ticks import RobotTicks
from roboglot.simulation.people.crowd import HABITS, Crowd
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.world.physics import Physics

STAGES = [GIMBALS, TOUCHED, MEASURED, WATCHED, RECKONED]  # stages of parts, as the kernel takes their tables


@dataclass(frozen=True, slots=True)
class UnfinishedTick:
    """Number of ticks begun; the stage at which the last one stopped (DONE: it is over), and that stage's number."""

    ticks: int
    stage: int
    count: int


class Ticking:
    """Ticks of one world. ``calm``: in the last ones no robot moved, and they needed nothing but the kernel."""

    def __init__(self, physics: Physics, crowd: Crowd, rounds: RobotTicks, seconds: float) -> None:
        """``seconds``: length of a tick."""
        self._physics, self._crowd, self._robot_ticks, self._seconds = physics, crowd, rounds, seconds
        self.calm = False
        self._run: Callable[..., int] | None = None
        self._gathered = 0  # count of the rounds from which these are
        self._arrays: tuple[object, ...] = ()
        self._settings: tuple[float, ...] = ()
        self._refresh: list[Callable[[], None]] = []
        self._steps, self._others = 0, physics.tables.others

    def load_kernels(self) -> None:
        """Do several ticks at once from now on, where that is possible; results stay the same, to the last bit."""
        with loading():
            from roboglot.kernels import ticks

        self._run = ticks.run

    @property
    def lean(self) -> bool:
        """True if ``run`` may do the gimbals of the next tick."""
        return self._run is not None and self._physics.moves_freely

    def run(self, ticks: int, number: int, origin: float, *, followed: bool) -> UnfinishedTick:
        """Begin up to ``ticks`` ticks after tick ``number`` (0: one, without the kernel); ``end`` finishes the last.

        ``followed``: shared control of the first one has run; ``origin``: stamp of tick 0, s.
        """
        self.calm = False
        if not ticks:
            return UnfinishedTick(1, DRIVE, 0)
        if self._gathered != self._robot_ticks.gathered:
            self._gather()
        course = self._physics.course() if self._arrays else None
        if course is None or self._run is None:
            return UnfinishedTick(1, DRIVE, 0) if followed else UnfinishedTick(0, GIMBALS, 0)
        if self._settings[0] != origin:
            self._settings = origin, *self._settings[1:]
        for refresh in self._refresh:
            refresh()
        free_motion, sleep, known = course
        answer = self._run(
            *self._arrays,
            self._settings,
            self._steps,
            number,
            ticks,
            followed,
            known and free_motion.parted,
            sleep.holds,
            free_motion.free,
            self._others,
        )
        begun, rest = divmod(answer, TICKS_UNIT)
        count, rest = divmod(rest, COUNT_UNIT)
        stage, moved = divmod(rest, STAGE_UNIT)
        if begun > (stage == PEOPLE):
            self._physics.moved(awake=bool(moved), known=known)
        self.calm = stage == DONE and sleep.holds
        return UnfinishedTick(begun, stage, count)

    def _gather(self) -> None:
        """Take the arrays of the robots' parts and of the physics; none if there are parts that the kernel lacks."""
        rounds, self._arrays, course = self._robot_ticks, (), self._physics.course()
        every = [control.stage for control in rounds.controls] + [sense.stage for sense in rounds.senses]
        stages = [stage for stage in every if stage is not None]
        if (
            self._run is None
            or course is None
            or [stage.number for stage in stages] != STAGES
            or len(stages) < len(every)
        ):
            return
        self._gathered = rounds.gathered
        free_motion, sleep, _ = course
        tables = self._physics.around_people[0], *(table for stage in stages for table in stage.tables)
        scene, geoms = (self._crowd.table, *free_motion.scene), free_motion.geoms
        self._arrays = tables, scene, geoms, free_motion.state, free_motion.servos, sleep.now, sleep.kept
        self._refresh = [stage.refresh for stage in stages if stage.refresh is not None]
        step, *physical = free_motion.settings
        limits = self._seconds, step, RESTS, STOREY, LIFTED
        self._settings = 0.0, *limits, *physical, *HABITS, *(number for stage in stages for number in stage.settings)
        self._steps = round(self._seconds / step)

    def end(self, left: UnfinishedTick, stamp: float, after_substep: Callable[[float], None] | None = None) -> None:
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
        for sense in self._robot_ticks.senses:
            if sense.stage is None or sense.stage.number > stage:
                sense(stamp, seconds)
            elif sense.stage.number == stage:
                sense.end(count, stamp, seconds)
