"""Environment shared by the parts of all robots: building, things, radio, sound and sight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboglot.model.geometry import Pose
from roboglot.simulation.building.building import Building
from roboglot.simulation.building.things import Things
from roboglot.simulation.detectors.observation import Surroundings
from roboglot.simulation.radio.gadgets import Gadgets
from roboglot.simulation.radio.radio import Radio
from roboglot.simulation.rendering.render_pool import RenderPool
from roboglot.simulation.sound.sound import SoundField
from roboglot.simulation.world.beads import Beads
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.randomness import RandomStreams
from roboglot.simulation.world.sight import Sight
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays


@dataclass(frozen=True, slots=True)
class Environment:
    """Shared objects of one world. ``north``: direction of north in the world frame, rad."""

    description: WorldDescription
    building: Building
    things: Things
    radio: Radio
    gadgets: Gadgets
    air: SoundField
    sight: Sight
    rays: Rays
    surroundings: Surroundings
    render_pool: RenderPool
    beads: Beads
    chances: RandomStreams
    north: float

    @property
    def docks(self) -> Sequence[Sequence[Pose]]:
        """Poses of the charging docks, by floor (world; m, rad)."""
        return self.building.docks
