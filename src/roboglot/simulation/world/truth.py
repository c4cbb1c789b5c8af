"""Ground truth of a world: for tests, recordings and overlays. Read only; no robot may use it."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.model.geometry import Pose
from roboglot.simulation.building.things import Thing
from roboglot.simulation.components.motion.gripper import SimulatedGripper
from roboglot.simulation.world.beads import Landing
from roboglot.simulation.world.environment import Environment
from roboglot.simulation.world.placing import Places
from roboglot.simulation.world.population import Population


class Truth:
    """All poses are in the world's frame: m, rad."""

    def __init__(self, population: Population, environment: Environment) -> None:
        self._population, self._environment = population, environment

    def pose_of(self, name: str) -> Pose:
        """Return the pose of a robot's base_link. Raises NotFound."""
        return self._population.hull(name).pose

    def height_of(self, name: str) -> float:
        """Return a robot's base_link's height above its floor's level, m: on a ramp, or lifted. Raises NotFound."""
        return self._population.hull(name).rise

    def floor_of(self, name: str) -> int:
        """Return the floor of a robot; 0 is the lowest. Raises NotFound."""
        return self._population.hull(name).floor

    def has_room(self, name: str, pose: Pose) -> bool:
        """Return whether a robot could stand there, on its floor, without touching a still solid or another robot."""
        hull = self._population.hull(name)
        others = (h for h in self._population.hulls.values() if h is not hull and h.floor == hull.floor)
        radius = hull.body.hull.radius
        if any(other.pose.distance_to(pose) < radius + other.body.hull.radius for other in others):
            return False
        return Places(self._environment.description).free(pose, hull.floor, radius)

    @property
    def people(self) -> Sequence[tuple[int, Pose]]:
        """Floor and pose of each person."""
        return [(walker.floor, walker.pose) for walker in self._population.walkers]

    def held_by(self, name: str) -> Thing | None:
        """Return the thing that a robot's gripper really holds; None: nothing. Raises NotFound."""
        gripper = self._population.find(name, SimulatedGripper)
        return gripper.holds if gripper else None

    def thing(self, name: str) -> Thing:
        """Return a small thing: its ``position``, and whether it is ``carried``. Raises NotFound."""
        return self._environment.things[name]

    @property
    def bead_landings(self) -> Sequence[Landing]:
        """Places where the last gel beads burst, the newest last."""
        return tuple(self._environment.beads.landed)
