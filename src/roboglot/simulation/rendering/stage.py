"""Scenery for a camera's renderer: still meshes per floor, made once, and moving figures, made for each picture.

Truth, world frame, z from the ground floor. Knows no sensor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import chain

import numpy as np

from roboglot.model.geometry import ORIGIN, wrap_angle
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.simulation.building.blueprint import SolidKind, solids_of
from roboglot.simulation.building.lift import LiftCar
from roboglot.simulation.building.props import Props
from roboglot.simulation.building.tags import moving_tags
from roboglot.simulation.building.things import Thing
from roboglot.simulation.people.people import Walker
from roboglot.simulation.rendering.figures import ROBOTS, can, person, robot
from roboglot.simulation.rendering.fittings import bead, car, fittings
from roboglot.simulation.rendering.floor_plan import Plan, plan_of
from roboglot.simulation.rendering.interior import CEILING, GROUNDS, SKY, interior, movable, printed, symbols_of
from roboglot.simulation.rendering.shapes import UNTURNED, Mesh, joined, paint_row, posed
from roboglot.simulation.rendering.textures import Masks
from roboglot.simulation.rendering.views import REACH, Eye, Figure, Ground, Instant, Scene
from roboglot.simulation.world.beads import Beads
from roboglot.simulation.world.description import WorldDescription
from roboglot.values import dataclass

FAR_AWAY = 60.0  # m beyond which people are not drawn
FLOOR_LIGHT = 0.95
LEVEL = (0.0, 0.0)
SLACK = 0.1  # rad around an eye's view: one that nods or leans sees slightly more at its picture's corners


@dataclass(frozen=True, slots=True)
class MovingThings:
    """Other visible things: robots' parts in their present state, beads in the air, the lift's car."""

    robots: Mapping[str, Robot]
    beads: Beads
    lift: LiftCar | None


class Stage:
    """Scenery of one world for its cameras, always with the present ``props`` and ``walkers``."""

    def __init__(
        self,
        world: WorldDescription,
        hulls: Sequence[Hull],
        walkers: Sequence[Walker],
        props: Props,
        things: Iterable[Thing],
        life: MovingThings,
    ) -> None:
        self._world, self._hulls, self._walkers, self._props = world, hulls, walkers, props
        self._things, self._life = things, life
        self._masks = Masks(symbols_of(world))
        self._floors: dict[int, tuple[Plan, Mesh, Ground]] = {}

    def instant(self, number: int, viewer: Hull, eye: Eye) -> Instant:
        """Return the figures before the eye, without the viewer. Quick: it runs between two physics steps."""
        sector = _Sector(eye.x, eye.y, eye.yaw, eye.spread)
        figures = (self._people(number, sector), self._robots(number, viewer, sector), self._loose(number, sector),
                   self._furniture(number, sector))  # fmt: skip
        return Instant(number, tuple(chain(*figures)))

    def scene(self, instant: Instant) -> Scene:
        """Return everything to draw; may run in any thread."""
        plan, still, ground = self._floor(instant.floor)
        figures = instant.figures
        moving = [(figure.make(), figure.rotation, (figure.x, figure.y, figure.z)) for figure in figures]
        shadows = plan.shadows_with((figure.x, figure.y, figure.radius) for figure in figures)
        meshes = (still, posed(moving)) if moving else (still,)
        return Scene(meshes, ground, plan, shadows, self._masks.rows)

    def _floor(self, number: int) -> tuple[Plan, Mesh, Ground]:
        if number not in self._floors:
            world, floor, elevation = self._world, self._world.floors[number], self._world.elevation(number)
            solids = solids_of(floor, world.lift, lift_here=False)
            plan = plan_of(floor, solids)
            still = [solid for solid in solids if solid.kind in (SolidKind.WALL, SolidKind.FURNITURE)]
            mesh = joined(interior(floor, still, plan, self._masks)).placed(0.0, 0.0, elevation, 0.0)
            ground = _ground(int(plan.rooms.max()) + 1, elevation, floor.height, floor.enclosed)
            self._floors[number] = plan, mesh, ground
        return self._floors[number]

    def _people(self, number: int, sector: _Sector) -> Iterator[Figure]:
        elevation = self._world.elevation(number)
        for walker in self._walkers:
            if walker.floor == number:
                pose, radius = walker.pose, walker.person.radius
                if sector.has(pose.x, pose.y, radius + REACH):
                    make = partial(person, walker.look, walker.joints)
                    yield Figure(make, pose.x, pose.y, elevation, rotation(LEVEL, pose.yaw), radius)

    def _robots(self, number: int, viewer: Hull, sector: _Sector) -> Iterator[Figure]:
        for index, hull in enumerate(self._hulls):
            if hull.floor != number or hull is viewer:
                continue
            pose, section = hull.pose, hull.body.hull
            if sector.has(pose.x, pose.y, section.radius + REACH):
                make = partial(robot, index % len(ROBOTS), section, round(hull.belly, 2), hull.body.walks)
                if owner := self._life.robots.get(hull.name):
                    make = partial(_together, (make, *fittings(owner, hull)))
                yield Figure(make, pose.x, pose.y, hull.elevation, rotation(hull.tilt, pose.yaw), section.radius)

    def _loose(self, number: int, sector: _Sector) -> Iterator[Figure]:
        """Yield things that may change floors: small things, beads and the lift's car."""
        elevation, storey = self._world.elevation(number), self._world.floors[number].height
        for index, thing in enumerate(self._things):
            x, y, z = thing.position.tolist()
            radius = thing.diameter / 2
            if _inside(z, elevation, storey) and sector.has(x, y, radius + REACH):
                make = partial(can, index, thing.diameter, thing.height)
                yield Figure(make, x, y, z, UNTURNED, radius)
        for x, y, z in self._life.beads.places:
            if _inside(z, elevation, storey) and sector.has(x, y, REACH):
                yield Figure(bead, x, y, z, UNTURNED, 0.0)
        if (lift := self._life.lift) is not None and _inside(lift.elevation, elevation, storey):
            frame, size = lift.frame, lift.section.size
            if sector.has(frame.x, frame.y, sum(size)):
                turned = rotation(LEVEL, frame.yaw)
                yield Figure(partial(car, *size), frame.x, frame.y, lift.elevation, turned, 0.0)

    def _furniture(self, number: int, sector: _Sector) -> Iterator[Figure]:
        """Yield movable furniture, and the tags on it."""
        elevation = self._world.elevation(number)
        for solid in self._props.on(number):
            pose, radius = solid.pose, max(solid.size[:2]) / 2
            if sector.has(pose.x, pose.y, radius + REACH):
                make = partial(movable, replace(solid, pose=ORIGIN))
                yield Figure(make, pose.x, pose.y, elevation, rotation(LEVEL, pose.yaw), radius)
        for tag in moving_tags(self._world, self._props, number):
            pose, here = tag.card.pose, replace(tag, card=replace(tag.card, pose=ORIGIN))
            if sector.has(pose.x, pose.y, REACH):
                make = partial(printed, here, self._masks)
                yield Figure(make, pose.x, pose.y, elevation, rotation(LEVEL, pose.yaw), 0.0)


def _together(makes: tuple[Callable[[], Mesh], ...]) -> Mesh:
    return _joined(tuple(make() for make in makes))


@lru_cache(maxsize=256)
def _joined(meshes: tuple[Mesh, ...]) -> Mesh:
    """Return a robot with its fittings, cached until an arm or a leg moves."""
    return joined(meshes)


def _inside(height: float, elevation: float, storey: float) -> bool:
    return elevation - 0.1 <= height < elevation + storey - 0.1


@dataclass(frozen=True, slots=True)
class _Sector:
    """Sector seen from above by an eye at (x, y): ``spread`` rad around ``yaw``, of limited length."""

    x: float
    y: float
    yaw: float
    spread: float

    def has(self, x: float, y: float, reach: float) -> bool:
        """True if anything within ``reach`` m of a place may be visible."""
        dx, dy = x - self.x, y - self.y
        away = math.hypot(dx, dy)
        if away <= reach or away > FAR_AWAY:
            return away <= reach
        off = abs(wrap_angle(math.atan2(dy, dx) - self.yaw))
        return off <= self.spread / 2 + SLACK + math.asin(reach / away)


def _ground(rooms: int, elevation: float, height: float, enclosed: bool) -> Ground:
    paints = [GROUNDS[room % len(GROUNDS)] for room in range(rooms)]
    above = CEILING if enclosed else SKY
    rows = [paint_row(paint, FLOOR_LIGHT) for paint in paints] + [paint_row(above, 1.0)]
    textures = [paint.texture for paint in paints] + [above.texture]
    return Ground(np.array(rows, dtype=np.float32), np.array(textures, dtype=np.int32), elevation, elevation + height)
