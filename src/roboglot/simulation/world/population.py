"""The robots and people of one world by name, for its truth, stage and steps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, TypeVar

from roboglot.model.components.component import Component
from roboglot.model.errors import ComponentMissing, NotFound
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.assembly import SimulatedRobot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.people.crowd import Crowd
from roboglot.simulation.people.people import Walker
from roboglot.simulation.world.description import Person
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.world.physics import Physics

P = TypeVar("P")


@dataclass(frozen=True, slots=True)
class Population:
    """``robots`` and ``simulated`` grow as robots are equipped; their hulls are in the physics from the start."""

    physics: Physics
    crowd: Crowd
    robots: dict[str, Robot] = field(default_factory=dict)
    simulated: dict[str, SimulatedRobot] = field(default_factory=dict)
    starts: dict[str, tuple[Pose, int]] = field(default_factory=dict)  # the initial place and floor of each

    @property
    def walkers(self) -> Sequence[Walker]:
        """The people."""
        return self.crowd.walkers

    @property
    def hulls(self) -> Mapping[str, Hull]:
        """Every robot's body in the physics."""
        return self.physics.hulls

    def hull(self, name: str) -> Hull:
        """Return a robot's body in the physics. Raises NotFound."""
        try:
            return self.physics.hulls[name]
        except KeyError:
            raise NotFound(f"no robot here is named {name!r}") from None

    def robot(self, name: str) -> Robot:
        """Return the robot that was equipped under this name. Raises NotFound."""
        try:
            return self.robots[name]
        except KeyError:
            raise NotFound(f"no robot here is named {name!r}") from None

    def find(self, name: str, kind: type[P]) -> P | None:
        """Return a robot's simulated part of this class, if it has one. Raises NotFound for an unknown robot."""
        self.hull(name)
        return self.simulated[name].find(kind)

    def part(self, name: str, kind: type[P], interface: type[Component]) -> P:
        """Return the same part. Raises ComponentMissing if the body has none."""
        part = self.find(name, kind)
        if part is None:
            raise ComponentMissing(interface)
        return part

    def walker(self, name: str) -> Walker:
        """Return a person by name or by place in the file ("person 0 2": the third on floor 0). Raises NotFound."""
        for walker in self.walkers:
            if walker.key == name:
                return walker
        raise NotFound(f"no person here is named {name!r}")

    def add_walker(self, pose: Pose, floor: int, name: str) -> Walker:
        """Add a person who is not in the world file. Raises ValueError for a taken name or too many people."""
        body = self.physics.spare_person({walker.body for walker in self.walkers})
        if any(walker.key == (name or body) for walker in self.walkers):
            raise ValueError(f"there is a person {name or body} already")
        person = Person(path=((pose.x, pose.y),), facing=math.degrees(pose.yaw), name=name or body)
        walker = Walker(person, floor, body, look=max((walker.look for walker in self.walkers), default=0) + 1)
        self.crowd.join(walker)
        return walker

    def remove_walker(self, name: str) -> None:
        """Take a person away. Raises NotFound."""
        self.crowd.leave(self.walker(name))
