"""Small things that can be pushed, gripped and carried. Handles into MuJoCo's arrays; truth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.model.errors import NotFound
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.world.description import Thing as ThingSection
from roboglot.simulation.world.description import WorldDescription

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

Floats = NDArray[np.float64]


class Thing:
    """One small thing."""

    def __init__(self, model: MjModel, data: MjData, section: ThingSection, elevation: float) -> None:
        self.name, self.diameter, self.height, self.mass = section.name, section.diameter, section.height, section.mass
        self.carried = False
        self._origin = np.array((*section.at, elevation))
        joint = model.joint(f"thing {section.name} x")
        place, rate = joint.qposadr[0], joint.dofadr[0]
        self._place, self._rate = data.qpos[place : place + 3], data.qvel[rate : rate + 3]
        self._applied = data.qfrc_applied[rate : rate + 3]
        self._weight = float(model.body_subtreemass[model.body(f"thing {section.name}").id]) * GRAVITY
        geoms = [model.geom(f"thing {section.name}{part}").id for part in ("", " foot")]
        self._contacts = [
            (model.geom_contype[geom : geom + 1], model.geom_conaffinity[geom : geom + 1]) for geom in geoms
        ]
        self._bits = [(int(kind[0]), int(affinity[0])) for kind, affinity in self._contacts]

    @property
    def position(self) -> Floats:
        """Middle of the foot (world), m."""
        position: Floats = self._origin + self._place
        return position

    def put(self, position: Floats) -> None:
        """Place the thing at ``position`` (world, m), at rest."""
        self._place[:] = position - self._origin
        self._rate[:] = 0.0

    def take(self) -> None:
        """Start being carried, without collisions."""
        self.carried = True
        for kind, affinity in self._contacts:
            kind[0] = affinity[0] = 0
        self._applied[2] = self._weight

    def carry(self, position: Floats, velocity: tuple[float, float, float]) -> None:
        """Move with the gripper (world; m, m/s)."""
        self._place[:] = position - self._origin
        self._rate[:] = velocity

    def drop(self) -> None:
        """End being carried: the thing falls."""
        self.carried = False
        for (kind, affinity), bits in zip(self._contacts, self._bits, strict=True):
            kind[0], affinity[0] = bits
        self._applied[2] = 0.0


class Things:
    """All things of a world."""

    def __init__(self, model: MjModel, data: MjData, world: WorldDescription) -> None:
        self._by_name = {
            section.name: Thing(model, data, section, world.elevation(number))
            for number, floor in enumerate(world.floors)
            for section in floor.things
        }

    def __iter__(self) -> Iterator[Thing]:
        return iter(self._by_name.values())

    def __getitem__(self, name: str) -> Thing:
        try:
            return self._by_name[name]
        except KeyError:
            raise NotFound(f"no thing here is named {name!r}") from None
