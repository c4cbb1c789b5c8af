"""What stands where, as a camera's renderer needs it: still meshes per floor, made once, and who moves, made anew.

Truth, world frame, z from the ground floor. Knows no sensor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboglot.simulation.blueprint import Solid, solids_of
from roboglot.simulation.camera_figures import person, robot
from roboglot.simulation.camera_interior import CEILING, GROUND_TILE, GROUNDS, SKY, carton, interior
from roboglot.simulation.camera_plan import Plan, plan_of
from roboglot.simulation.camera_shapes import Mesh, joined, paint_row
from roboglot.simulation.camera_textures import Masks
from roboglot.simulation.description import WorldDescription
from roboglot.simulation.hull import Hull
from roboglot.simulation.people import Walker

FAR_AWAY = 60.0  # m beyond which nobody is drawn
FLOOR_LIGHT = 0.95


@dataclass(frozen=True, slots=True)
class Ground:
    """Floor and ceiling: a paint per room, then the ceiling's; heights in world."""

    paints: NDArray[np.float32]
    textures: NDArray[np.int32]
    floor: float
    ceiling: float


@dataclass(frozen=True, slots=True)
class Scene:
    """One instant of one floor, complete in itself: it can be drawn in another thread."""

    mesh: Mesh
    ground: Ground
    plan: Plan
    shadows: NDArray[np.uint8]
    masks: NDArray[np.uint32]


class Stage:
    """Everything that cameras may see. ``obstacles`` and ``walkers`` are looked at anew each time."""

    def __init__(
        self,
        world: WorldDescription,
        hulls: Sequence[Hull],
        walkers: Sequence[Walker],
        obstacles: Mapping[int, tuple[int, Solid]],
    ) -> None:
        self._world, self._hulls, self._walkers, self._obstacles = world, hulls, walkers, obstacles
        self._masks = Masks([marker.symbol for floor in world.floors for marker in floor.markers])
        self._floors: dict[int, tuple[Plan, Mesh, Ground]] = {}

    def scene(self, number: int, viewer: Hull, x: float, y: float) -> Scene:
        """What there is on a floor now, around (x, y), without the viewer itself."""
        plan, still, ground = self._floor(number)
        moving, discs = [], []
        for mesh, disc in self._moving(number, viewer):
            if math.hypot(disc[0] - x, disc[1] - y) < FAR_AWAY:
                moving.append(mesh)
                discs.append(disc)
        mesh = joined([still, *moving]) if moving else still
        return Scene(mesh, ground, plan, plan.shadows_with(discs), self._masks.rows)

    def _floor(self, number: int) -> tuple[Plan, Mesh, Ground]:
        if number not in self._floors:
            world, floor, elevation = self._world, self._world.floors[number], self._world.elevation(number)
            parked = world.lift is not None and world.lift.parked_at == number
            solids = list(solids_of(floor, world.lift, parked))
            plan = plan_of(floor, solids)
            mesh = joined(interior(floor, solids, plan, self._masks)).placed(0.0, 0.0, elevation, 0.0)
            ground = _ground(int(plan.rooms.max()) + 1, elevation, floor.height, floor.enclosed)
            self._floors[number] = plan, mesh, ground
        return self._floors[number]

    def _moving(self, number: int, viewer: Hull) -> Iterator[tuple[Mesh, tuple[float, float, float]]]:
        """Whoever is on that floor, with the disc that it stands on (x, y, radius)."""
        elevation = self._world.elevation(number)
        for index, walker in enumerate(self._walkers):
            if walker.floor == number:
                pose, who = walker.pose, walker.person
                walked = pose.x * math.cos(pose.yaw) + pose.y * math.sin(pose.yaw)
                mesh = person(index, who.height, who.radius, walked if walker.walking else None)
                yield mesh.placed(pose.x, pose.y, elevation, pose.yaw), (pose.x, pose.y, who.radius)
        for index, hull in enumerate(self._hulls):
            if hull.floor == number and hull is not viewer:
                pose, radius = hull.pose, hull.body.hull.radius
                mesh = robot(index, hull.body.hull, round(hull.belly, 2))
                yield mesh.placed(pose.x, pose.y, hull.elevation, pose.yaw), (pose.x, pose.y, radius)
        for floor, solid in self._obstacles.values():
            if floor == number:
                disc = solid.pose.x, solid.pose.y, max(solid.size[:2]) / 2
                yield carton(solid).placed(0.0, 0.0, elevation, 0.0), disc


def _ground(rooms: int, elevation: float, height: float, enclosed: bool) -> Ground:
    paints = [GROUNDS[room % len(GROUNDS)] for room in range(rooms)]
    above = CEILING if enclosed else SKY
    rows = [paint_row(paint, FLOOR_LIGHT) for paint in paints] + [paint_row(above, 1.0)]
    textures = [paint.texture for paint in paints] + [above.texture]
    return Ground(np.array(rows, dtype=np.float32), np.array(textures, dtype=np.int32), elevation, elevation + height)


__all__ = ["GROUND_TILE", "Ground", "Scene", "Stage"]
