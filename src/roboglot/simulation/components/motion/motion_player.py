"""Plays motions and choreographies: one frame per tick, to the base, the torso and the feet."""

from __future__ import annotations

from roboglot.model.action import Action
from roboglot.model.clock import Clock
from roboglot.model.geometry import STILL
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.performing import Performance, Stance
from roboglot.simulation.bodies.readiness import in_the_way
from roboglot.simulation.bodies.steps import Steps
from roboglot.simulation.bodies.torso import Torso
from roboglot.simulation.bodies.walking_body import given_up
from roboglot.simulation.components.motion.base import SimulatedBase


class MotionPlayer:
    """Player; ``performance``: the present one, None: none."""

    def __init__(self, hull: Hull, base: SimulatedBase, torso: Torso, steps: Steps, stance: Stance) -> None:
        self._hull, self._base, self._torso, self._steps, self._stance = hull, base, torso, steps, stance
        self.performance: Performance | None = None

    async def perform(self, performance: Performance, action: Action, clock: Clock, period: float) -> None:
        """Perform until the motion is over or replaced, checking every ``period`` s; hold it while paused."""
        self.performance = performance
        while not performance.over and self.performance is performance:
            await action.hold(performance.hold)
            performance.held = False
            await clock.sleep(period)

    async def until_over(self, performance: Performance, clock: Clock, period: float) -> None:
        """Wait until a performance is over or replaced, checking every ``period`` s."""
        while not performance.over and self.performance is performance:
            await clock.sleep(period)

    def give_up(self, performance: Performance) -> None:
        """Replace the remaining frames: land if in the air, then straighten."""
        torso, performance.held = self._torso, False
        performance.frames = given_up(performance, self._hull, torso.body, torso.straight, self._stance)

    def play(self, performance: Performance) -> None:
        """Move base_link, torso and feet by the next frame; give up a motion that meets an obstacle."""
        frame = performance.frame
        if performance.held and not performance.in_the_air:
            self._base.carry(STILL)
            return
        if frame and not performance.hit and in_the_way(self._hull, frame.twist):
            performance.hit = True
            self.give_up(performance)
        performance.frame = frame = next(performance.frames, None)
        if frame is None:
            performance.over = True
            self._base.carry(STILL)
            return
        held_back = self._steps.hold_back(frame)
        self._base.carry(STILL if held_back else frame.twist)
        if frame.lift != performance.lift:
            performance.lift = frame.lift
            self._steps.step_over(frame.lift)
        if frame.leap:
            self._hull.leap(frame.twist.x, frame.twist.y, frame.twist.yaw, frame.leap)
        elif frame.landed:
            self._hull.stop()
        self._torso.body = frame.body
        self._torso.take(frame.body, weightless=frame.airborne)
