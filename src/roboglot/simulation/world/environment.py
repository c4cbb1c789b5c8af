"""Environment that the parts of all robots share: the building, the air, and what is seen, heard and reached."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from roboglot.model.geometry import Pose
from roboglot.simulation.building.building import Building
from roboglot.simulation.building.things import Things
from roboglot.simulation.detectors.glance import Surroundings
from roboglot.simulation.radio.gadgets import Gadgets
from roboglot.simulation.radio.radio import Radio
from roboglot.simulation.rendering.studio import Studio
from roboglot.simulation.sound.sound import Air
from roboglot.simulation.world.beads import Beads
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.randomness import Chances
from roboglot.simulation.world.sight import Sight

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays


@dataclass(frozen=True, slots=True)
class Environment:
    """One world's. ``north``: the direction of north in the world frame, rad."""

    description: WorldDescription
    building: Building
    things: Things
    radio: Radio
    gadgets: Gadgets
    air: Air
    sight: Sight
    rays: Rays
    surroundings: Surroundings
    studio: Studio
    beads: Beads
    chances: Chances
    north: float

    @property
    def docks(self) -> Sequence[Sequence[Pose]]:
        """Charging docks by floor, world frame."""
        return self.building.docks
