"""Electronic skin of a simulated body: three patches on the trunk, one on each leg with a foot."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from roboglot.model.components.interaction.skin import ElectronicSkin, Shade, SkinPattern
from roboglot.model.components.interaction.skin_effects import ShownSkin
from roboglot.model.components.motion.feet import Foot, FootState
from roboglot.model.components.motion.legs import Legs
from roboglot.model.errors import Refused
from roboglot.model.events import Rebooted
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part


class SkinSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A skin whose patches turn dark and light."""


class SimulatedSkin(ShownSkin):
    """Skin that reads the standing legs from its robot's feet."""

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot.clock, f"{seed} {robot.id}")
        self._robot = robot
        robot.events.listen(Rebooted, lambda _: self.start_afresh())

    @property
    def feet(self) -> Mapping[Foot, FootState]:
        return self._robot[Legs].feet if Legs in self._robot else {}

    def show(self, pattern: SkinPattern, *, cycle: float = 1.0, standing: Shade = Shade.LIGHT) -> None:
        if pattern is SkinPattern.FOOTFALLS and not self.feet:
            raise Refused("this body has no feet")
        super().show(pattern, cycle=cycle, standing=standing)


def _fit(fit: Fitting) -> SimulatedSkin:
    return SimulatedSkin(fit.robot, fit.world.chances.seed)


PART = Part(name="skin", interface=ElectronicSkin, section=SkinSection, fit=_fit)
