"""Electronic skin of a simulated body: three patches of the trunk, and one on each leg of those that walk."""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.model.components.interaction.skin import Shade, SkinPattern
from roboglot.model.components.interaction.skin_effects import ShownSkin
from roboglot.model.components.motion.feet import Foot, FootState
from roboglot.model.components.motion.legs import Legs
from roboglot.model.errors import Refused
from roboglot.model.robot import Robot


class SimulatedSkin(ShownSkin):
    """Sees from the feet of its robot which leg stands."""

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot.clock, f"{seed} {robot.id}")
        self._robot = robot

    @property
    def feet(self) -> Mapping[Foot, FootState]:
        return self._robot[Legs].feet if Legs in self._robot else {}

    def show(self, pattern: SkinPattern, *, cycle: float = 1.0, standing: Shade = Shade.LIGHT) -> None:
        if pattern is SkinPattern.FOOTFALLS and not self.feet:
            raise Refused("this body has no feet that could be shown")
        super().show(pattern, cycle=cycle, standing=standing)
