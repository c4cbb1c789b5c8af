"""Ground truth of a world: for tests, recordings and overlays. Read only; no robot may use it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.blueprint import Solid, SolidKind, person_solid, solids_of
from roboglot.simulation.building.overlap import overlap
from roboglot.simulation.building.things import Thing
from roboglot.simulation.components.motion.gripper import SimulatedGripper
from roboglot.simulation.world.beads import Landing
from roboglot.simulation.world.environment import Environment
from roboglot.simulation.world.placing import GAP, IN_THE_WAY, Places
from roboglot.simulation.world.population import Population

TOUCH = 0.01  # m by which a robot that stands beside something may overlap it


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
        places = Places(self._environment.description)
        return places.free(pose, hull.floor, hull.body.hull.radius) and not self.in_the_way(name, pose, hull.floor)

    def in_the_way(self, name: str, pose: Pose, floor: int) -> str:
        """Return what a robot there would overlap: a name, or one of IN_THE_WAY; empty: nothing. Raises NotFound."""
        hull = self._population.hull(name)
        wanted = _solid(hull, pose)
        for key, other in self._population.hulls.items():
            if other is not hull and other.floor == floor and overlap(wanted, _solid(other, other.pose)):
                return key
        for walker in self._population.walkers:
            if walker.floor == floor and overlap(wanted, person_solid(walker.person, walker.pose)):
                return walker.key
        for solid in self._solids(floor):
            if overlap(wanted, solid):
                return IN_THE_WAY[solid.kind]
        elevation = self._population.physics.props.elevation(floor)
        if self._environment.building.footing.missing(pose.x, pose.y, floor, elevation):
            return GAP
        return ""

    def robot_in(self, solid: Solid, floor: int) -> str:
        """Return the name of a robot that something put there would overlap; empty: none."""
        hulls = self._population.hulls.items()
        return next((key for key, hull in hulls if hull.floor == floor and overlap(_solid(hull, hull.pose), solid)), "")

    def _solids(self, floor: int) -> Iterator[Solid]:
        """Yield everything on a floor that a robot may bump into, but robots, people and small things."""
        world = self._environment.description
        # Docks and doors of the lift are props, as they move.
        yield from (
            s for s in solids_of(world.floors[floor], world.lift, lift_here=True) if s.kind is not SolidKind.DOCK
        )
        yield from self._population.physics.props.on(floor)

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


def _solid(hull: Hull, pose: Pose) -> Solid:
    """Return a robot's outline there; a little narrower, so that robots may touch things."""
    low, top, width = hull.body.hull.clearance, hull.belly + hull.body.hull.torso_height, hull.body.hull.radius - TOUCH
    return Solid(SolidKind.FURNITURE, pose, (2 * width, 2 * width, top - low), base=low, round=True)
