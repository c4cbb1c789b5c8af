"""Standing up and lying down take time; limp legs let the body sink. Walking is the base's business."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from roboglot.model.actions import Action
from roboglot.model.clock import Clock
from roboglot.model.components.driving import BASE
from roboglot.model.components.legs import LEGS, Legs, Posture
from roboglot.model.errors import Refused
from roboglot.model.events import PostureChanged
from roboglot.model.geometry import STILL
from roboglot.model.robot import Robot
from roboglot.simulation.body import Legs as LegsSection
from roboglot.simulation.components.base import SimulatedBase
from roboglot.simulation.hull import Hull

LOOK = 0.02  # s between looks at whether a motion has ended


class SimulatedLegs(Legs):
    """Moves the torso between two heights at the pace of the body's description."""

    def __init__(self, section: LegsSection, hull: Hull, base: SimulatedBase, robot: Robot) -> None:
        self._section, self._hull, self._base, self._robot = section, hull, base, robot
        self._clock: Clock = robot.clock
        self._posture = Posture.STANDING
        self._height = section.standing
        self._goal = section.standing
        self._pace = 0.0
        hull.put_belly(section.standing)

    @property
    def posture(self) -> Posture:
        return self._posture

    @property
    def body_height(self) -> float:
        return self._hull.belly

    def stand(self, *, source: str = "") -> Action:
        async def run(action: Action) -> None:
            await self._move(action, Posture.STANDING, self._section.standing, self._section.stand_time)

        return self._start("stand up", run, Posture.STANDING, source)

    def lie_down(self, *, source: str = "") -> Action:
        async def run(action: Action) -> None:
            if self._posture is Posture.LIMP:
                raise Refused("limp legs can only stand up")
            await self._move(action, Posture.LYING, self._section.lying, self._section.lie_time)

        return self._start("lie down", run, Posture.LYING, source)

    def go_limp(self) -> None:
        for action in self._robot.actions.running(BASE):
            action.cancel("emergency: the legs went limp")
        self._base.cut()
        self._hull.hold_belly(None)
        self._become(Posture.LIMP)

    def control(self, seconds: float) -> None:
        """Move the torso's set point on."""
        if self._pace and self._posture is Posture.CHANGING:
            step = self._pace * seconds
            self._height += max(-step, min(step, self._goal - self._height))
            self._hull.hold_belly(self._height)

    def _start(self, name: str, run: Callable[[Action], Awaitable[None]], wanted: Posture, source: str) -> Action:
        # Who is there already disturbs nobody who drives.
        resources = [LEGS] if self._posture is wanted else [LEGS, BASE]
        return self._robot.actions.start(name, run, resources=resources, goal=wanted, source=source)

    async def _move(self, action: Action, wanted: Posture, height: float, duration: float) -> None:
        """Brake, then bring the torso there; cancelled, it stays where it is, between the postures."""
        if self._posture is wanted:
            return
        await self._brake()
        self._height, self._goal = self._hull.belly, height
        self._pace = (self._section.standing - self._section.lying) / duration
        self._become(Posture.CHANGING)
        try:
            while self._height != self._goal:
                await self._clock.sleep(LOOK)
                await action.hold(self._halt)
                self._pace = self._pace or (self._section.standing - self._section.lying) / duration
            self._become(wanted)
        finally:
            self._pace = 0.0

    async def _brake(self) -> None:
        """Return when the wheels stand still; who cancels meanwhile finds the robot standing as before."""
        self._base.lock(LEGS, "the robot changes its posture")
        try:
            while self._base.velocity != STILL:
                await self._clock.sleep(LOOK)
        except BaseException:
            if self._posture is Posture.STANDING:
                self._base.unlock(LEGS)
            raise

    def _halt(self) -> None:
        self._pace = 0.0

    def _become(self, posture: Posture) -> None:
        if posture is self._posture:
            return
        self._posture = posture
        if posture is Posture.STANDING:
            self._base.unlock(LEGS)
        else:
            self._base.lock(LEGS, f"the robot cannot drive while {posture}")
        self._robot.events.publish(PostureChanged(stamp=self._clock.time(), posture=posture))
