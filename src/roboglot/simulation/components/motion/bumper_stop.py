"""The firmware's reaction to the bumper, below all motions and doors."""

from __future__ import annotations

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.driving import BASE
from roboglot.model.errors import Collided
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.sensing.bumper import SimulatedBumper


class BumperStop:
    """Blocks the wheels in the tick of a collision, and aborts the motion with Collided.

    Until the hull is free, the base refuses motion towards the obstacle (Collided); motion away from it, along it and
    turns on the spot stay possible. It reads the bumper only: a masked zone stops nothing, a stuck one does.
    """

    def __init__(self, robot: Robot, base: SimulatedBase, bumper: SimulatedBumper) -> None:
        self._robot, self._base, self._bumper = robot, base, bumper
        self.duty = Duty()
        bumper.reactions.append(self.duty)

    def sense(self, _stamp: float, _seconds: float) -> None:
        """Act after the bumper's own sensing, while it is pressed."""
        base, bumper = self._base, self._bumper
        if not bumper.touched:
            self.duty.end()
            return
        base.hindrances.touching = bumper.bearings
        if not base.collides:
            return
        base.cut()
        zones = " and ".join(zone for zone in bumper.zones if zone in bumper.pressed)
        for action in self._robot.actions.running(BASE):
            if action.status is ActionStatus.EXECUTING:
                action.abort(Collided(f"the hull touches something ({zones}): the bumper stopped the robot"))


def _fit(fit: Fitting) -> BumperStop | None:
    bumper = fit.find(SimulatedBumper)
    return BumperStop(fit.robot, fit.get(SimulatedBase), bumper) if bumper else None


PART = Part(
    name="bumper_stop",
    fit=_fit,
    after=("base", "bumper", "odometry"),
    sense=BumperStop.sense,
    duty=lambda stop: stop.duty,
)
