"""Launches beads along the gimbal's sight line. Their flight is the world's."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from roboglot.model.components.interaction.blaster import Blaster, check_beads
from roboglot.model.errors import Busy, Refused
from roboglot.model.events import BeadFired
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.components.motion.gimbal import SimulatedGimbal
from roboglot.simulation.world.beads import Beads


class BlasterSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``muzzle``: m ahead of the gimbal's axes; ``spread``: one standard deviation, rad; ``speed`` in m/s."""

    muzzle: Positive
    speed: Positive
    spread: Annotated[float, Meta(ge=0, le=0.5)]
    rate: Annotated[float, Meta(gt=0, le=50)]
    magazine: Annotated[int, Meta(ge=0, le=100_000)]


class SimulatedBlaster(Blaster):
    """Blaster on the gimbal; beads scatter a little and add the robot's own velocity."""

    def __init__(
        self,
        section: BlasterSection,
        hull: Hull,
        gimbal: SimulatedGimbal,
        beads: Beads,
        robot: Robot,
        random: np.random.Generator,
    ) -> None:
        self.rate = section.rate
        self._section, self._hull, self._gimbal, self._air = section, hull, gimbal, beads
        self._robot, self._random = robot, random
        self._beads, self._ammo = 1, section.magazine
        self.busy = Duty()
        self._due, self._wait = 0, 0.0  # beads of the shot still to be fired, and s until the next

    @property
    def beads(self) -> int:
        return self._beads

    def set_beads(self, beads: int) -> None:
        check_beads(beads)
        self._beads = beads

    @property
    def ammo(self) -> int:
        return self._ammo

    @property
    def firing(self) -> bool:
        return self._due > 0

    def fire(self) -> int:
        self._robot.actuators.check()
        if not self._ammo:
            raise Refused("the magazine is empty")
        if self._due:
            raise Busy("the last shot is still being fired")
        self._due = min(self._beads, self._ammo)
        self.busy.begin()
        return self._due

    def cease(self) -> None:
        self._due = 0

    def reload(self) -> None:
        self._ammo = self._section.magazine

    @property
    def idle(self) -> bool:
        """True if there is no bead to fire and no pause to wait for."""
        return not self._due and not self._wait

    def control(self, seconds: float) -> None:
        """Fire a bead when it is due; the rest of the shot is lost once the robot holds still."""
        if self._robot.actuators.held:
            self._due = 0
        if self.idle:
            self.busy.end()
            return
        stamp = self._robot.clock.time()
        self._wait = max(0.0, self._wait - seconds)
        if not self._due or self._wait > seconds / 2:
            return
        self._due, self._wait = self._due - 1, self._wait + 1.0 / self.rate
        self._ammo -= 1
        pivot, ahead = self._gimbal.sight_line()
        scattered = ahead + self._random.standard_normal(3) * self._section.spread
        vx, vy, vz, _ = self._hull.motion
        velocity = scattered / math.sqrt(scattered @ scattered) * self._section.speed + (vx, vy, vz)
        self._air.launch(pivot + ahead * self._section.muzzle, velocity, self._hull)
        self._robot.events.publish(BeadFired(stamp=stamp, ammo=self._ammo))


def _fit(fit: Fitting) -> SimulatedBlaster:
    gimbal, robot = fit.get(SimulatedGimbal), fit.robot
    chance = fit.chance("blaster")
    return SimulatedBlaster(fit.body[BlasterSection], fit.hull, gimbal, fit.world.beads, robot, chance)


PART = Part(
    name="blaster",
    interface=Blaster,
    section=BlasterSection,
    needs=("gimbal",),
    fit=_fit,
    after=("gimbal",),
    control=SimulatedBlaster.control,
    control_after=("gimbal",),
    duty=lambda blaster: blaster.busy,
)
