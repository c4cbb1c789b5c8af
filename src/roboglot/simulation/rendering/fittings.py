"""Moving details for cameras: gimbals, arms, jaws, lamps, beads, lift cars.

States come from the parts; meshes are in the robot's frame on the floor, +x ahead.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial

import numpy as np

from roboglot.model.components.interaction.light import DARK as DARKNESS
from roboglot.model.components.interaction.light import Colour, Light
from roboglot.model.components.motion.arm import Arm
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper
from roboglot.model.components.motion.legs import Legs
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.simulation.components.interaction.blaster import BlasterSection
from roboglot.simulation.components.motion.arm import ArmSection
from roboglot.simulation.components.motion.gimbal_axes import GimbalSection
from roboglot.simulation.components.motion.gripper import GripperSection
from roboglot.simulation.rendering.shapes import Floats, Mesh, Paint, box, card, joined, mesh_of, turned

BAR = 0.018  # m: half the thickness of an arm's bars
PAW, SHANK = 0.018, 0.16  # m: half a paw; minimum lengths of thigh and shank
ELBOW = 0.55  # length of each of an arm's two bars, relative to its reach
DARK, STEEL, BEAD = Paint((44, 46, 52)), Paint((150, 154, 160)), Paint((80, 200, 250), glows=True)
CAR_WALL, CAR_FLOOR, CAR_LAMP = Paint((176, 180, 184)), Paint((92, 88, 84)), Paint((255, 252, 240), glows=True)
RAIL = Paint((110, 112, 116))
CAR_HEIGHT, SKIN = 2.2, 0.03  # m: inside; distance of its panels from the shaft's walls
# Place of a zone's lamps: direction from the centre (rad), width (share of the radius), height (share of the torso).
PLACES: dict[str, tuple[float, float, float]] = {
    "front": (0.0, 0.7, 0.12),
    "head": (0.0, 0.9, 0.86),
    "eyes": (0.0, 0.35, 0.62),
    "rear": (math.pi, 0.7, 0.12),
    "tail": (math.pi, 0.9, 0.86),
    "left": (math.pi / 2, 0.9, 0.75),
    "right": (-math.pi / 2, 0.9, 0.75),
    "left_lower": (math.pi / 2, 0.9, 0.1),
    "right_lower": (-math.pi / 2, 0.9, 0.1),
}
Make = Callable[[], Mesh]


def fittings(robot: Robot, hull: Hull) -> Iterator[Make]:
    """Yield functions that make the robot's fittings in their present state. Quick: meshes are made later."""
    yield from _lamps(robot, hull)
    yield from _legs(robot, hull)
    gimbal, arm = hull.body.get(GimbalSection), hull.body.get(ArmSection)
    if gimbal and Gimbal in robot:
        yield _gimbal_of(robot, hull, gimbal)
    if arm and Arm in robot:
        yield _arm_of(robot, hull, arm)


def _lamps(robot: Robot, hull: Hull) -> Iterator[Make]:
    """Yield the zones that are lit, but for those on the gimbal."""
    if Light not in robot:
        return
    light, body = robot[Light], hull.body
    for zone in light.zones:
        if zone in PLACES and (mean := _mean(light.lamps(zone))) != DARKNESS:
            yield partial(_lamp, zone, mean, body.hull.radius, round(hull.belly, 3), body.hull.torso_height)


def _legs(robot: Robot, hull: Hull) -> Iterator[Make]:
    base = hull.body.base
    for foot in robot[Legs].feet.values() if hull.body.walks and Legs in robot else ():
        x, y, z = round(foot.position.x, 2), round(foot.position.y, 2), round(foot.position.z, 2)
        hip = math.copysign(base.wheel_base / 2, x), math.copysign(base.track / 2, y), round(hull.belly, 2)
        yield partial(_leg, hip, (x, y, z))


def _gimbal_of(robot: Robot, hull: Hull, gimbal: GimbalSection) -> Make:
    colours: tuple[Colour, ...] = ()
    if Light in robot:
        light = robot[Light]
        colours = tuple(_mean(light.lamps(zone)) for zone in light.zones if zone.startswith("gimbal"))
    blaster, angles = hull.body.get(BlasterSection), robot[Gimbal].angles
    at = (gimbal.forward, 0.0, round(hull.belly, 3) + gimbal.above_belly)
    muzzle = blaster.muzzle if blaster else 0.0
    return partial(_gimbal, at, round(angles.pitch, 2), round(angles.yaw, 2), muzzle, colours)


def _arm_of(robot: Robot, hull: Hull, arm: ArmSection) -> Make:
    gripper, end = hull.body.get(GripperSection), robot[Arm].position
    shoulder = (arm.forward, round(hull.belly, 3) + arm.above_belly)
    opening = robot[Gripper].opening if Gripper in robot else 0.0
    fingers = gripper.fingers if gripper else 0.0
    return partial(_arm, shoulder, (round(end.x, 3), round(end.z, 3)), arm.radius, round(opening, 3), fingers)


def _mean(lamps: Sequence[Colour]) -> Colour:
    """Return the mean colour of a zone's lamps."""
    if lamps.count(lamps[0]) == len(lamps):
        return lamps[0]
    return Colour(
        sum(lamp.red for lamp in lamps) // len(lamps),
        sum(lamp.green for lamp in lamps) // len(lamps),
        sum(lamp.blue for lamp in lamps) // len(lamps),
    )


@lru_cache(maxsize=256)
def _lamp(zone: str, colour: Colour, radius: float, belly: float, torso: float) -> Mesh:
    direction, width, height = PLACES[zone]
    at = (1.03 * radius * math.cos(direction), 1.03 * radius * math.sin(direction), belly + height * torso)
    paint = Paint((colour.red, colour.green, colour.blue), glows=True)
    return card(at, direction, (width * radius, max(0.012, 0.07 * torso)), paint)


@lru_cache(maxsize=512)
def _gimbal(
    at: tuple[float, float, float], pitch: float, yaw: float, muzzle: float, colours: tuple[Colour, ...]
) -> Mesh:
    """Return a turned yoke, with a nodding head between its arms."""
    nodding = _head(muzzle).moved(rotation((0.0, pitch), 0.0), (0.0, 0.0, 0.0))
    return joined([_yoke(colours), nodding]).placed(*at, yaw)


@lru_cache(maxsize=64)
def _yoke(colours: tuple[Colour, ...]) -> Mesh:
    """Return the yoke, with its lit lamps at both sides."""
    lamps = [
        card((0.0, side * 0.062, 0.0), side * math.pi / 2, (0.05, 0.05), Paint((c.red, c.green, c.blue), glows=True))
        for side, c in zip((1, -1), colours, strict=False)
        if c != Colour()
    ]
    sides = [box((0.05, 0.012, 0.07), DARK, STEEL, -0.05).placed(0.0, side * 0.055, 0.0, 0.0) for side in (-1, 1)]
    return joined([*sides, *lamps, turned([(0.05, -0.09, DARK), (0.05, -0.05, STEEL)], 8)])


@lru_cache(maxsize=8)
def _head(muzzle: float) -> Mesh:
    """Return the camera, and the barrel under it, if any."""
    parts = [box((0.09, 0.09, 0.06), STEEL, STEEL, -0.03), card((0.0461, 0.0, 0.008), 0.0, (0.03, 0.026), DARK)]
    if muzzle:
        parts.append(_bar(np.array((0.02, 0.0, -0.02)), np.array((muzzle, 0.0, -0.02)), 0.012, DARK))
    return joined(parts)


@lru_cache(maxsize=64)
def _arm(shoulder: tuple[float, float], end: tuple[float, float], reach: float, opening: float, fingers: float) -> Mesh:
    """Return two bars of equal length with the elbow above, and jaws; only the end point is simulated."""
    x, z = shoulder
    tip = np.array((x + end[0], 0.0, z + end[1]))
    root = np.array((x, 0.0, z))
    parts = _bent(root, tip, ELBOW * reach, (0.0, 0.0, 1.0), BAR, STEEL)
    if fingers:
        for side in (-1, 1):
            jaw = np.array((0.0, side * (opening / 2 + 0.006), 0.0))
            parts.append(_bar(tip + jaw, tip + jaw + (fingers, 0.0, 0.0), 0.006, DARK))
    return joined(parts)


@lru_cache(maxsize=1024)
def _leg(hip: tuple[float, float, float], foot: tuple[float, float, float]) -> Mesh:
    """Return a thigh and a shank with the knee behind, and a paw."""
    x, y, z = foot[0], foot[1], foot[2] + PAW
    tip = np.array((x, y, z))
    paw = turned([(0.5 * PAW, -PAW, DARK), (PAW, 0.0, DARK), (0.5 * PAW, PAW, DARK)], 6).placed(x, y, z, 0.0)
    return joined([*_bent(np.array(hip), tip, SHANK, (-1.0, 0.0, 0.0), 0.6 * PAW, STEEL), paw])


def _bent(
    root: Floats, tip: Floats, bar: float, towards: tuple[float, float, float], half: float, paint: Paint
) -> list[Mesh]:
    """Return two bars of equal length between two points, bent ``towards`` one side, at least ``bar`` m long."""
    way = tip - root
    away = max(float(np.linalg.norm(way)), 1e-6)
    aside = np.array(towards) - way * float(way @ towards) / away**2
    length = float(np.linalg.norm(aside))
    aside = aside / length if length > 1e-6 else np.array((0.0, 1.0, 0.0))
    rise = math.sqrt(max(0.0, max(bar, away / 2 + 1e-3) ** 2 - away * away / 4))
    joint = root + way / 2 + rise * aside
    return [_bar(root, joint, half, paint), _bar(joint, tip, half, paint)]


def _bar(start: Floats, end: Floats, half: float, paint: Paint) -> Mesh:
    """Return a square bar between two points."""
    way = end - start
    along = way / max(1e-9, float(np.linalg.norm(way)))
    aside = np.cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (0.0, 1.0, 0.0))
    aside = half * aside / np.linalg.norm(aside)
    up = np.cross(aside, along)
    ring = (aside + up, -aside + up, -aside - up, aside - up)
    sides = [[start + ring[(i + 1) % 4], start + ring[i], end + ring[i], end + ring[(i + 1) % 4]] for i in range(4)]
    ends = [[end + corner for corner in ring], [start + corner for corner in reversed(ring)]]
    return mesh_of([[point.tolist() for point in quad] for quad in (*sides, *ends)], [paint] * 6)


@lru_cache(maxsize=1)
def bead() -> Mesh:
    """Return a gel bead."""
    return turned([(0.001, -0.004, BEAD), (0.004, 0.0, BEAD), (0.001, 0.004, BEAD)], 6)


@lru_cache(maxsize=4)
def car(deep: float, wide: float) -> Mesh:
    """Return a lift car from inside, open to +x: floor, three walls with a rail, a lit ceiling."""
    x, y = deep / 2 - SKIN, wide / 2 - SKIN
    low, high = 0.005, CAR_HEIGHT
    quads = [
        [(-x, -y, low), (x, -y, low), (x, y, low), (-x, y, low)],
        [(-x, y, high), (x, y, high), (x, -y, high), (-x, -y, high)],
        [(-x, -y, low), (-x, y, low), (-x, y, high), (-x, -y, high)],
        [(-x, y, low), (x, y, low), (x, y, high), (-x, y, high)],
        [(x, -y, low), (-x, -y, low), (-x, -y, high), (x, -y, high)],
    ]
    paints = [CAR_FLOOR, CAR_LAMP, CAR_WALL, CAR_WALL, CAR_WALL]
    ends = (((-x + 0.06, -y + 0.06), (-x + 0.06, y - 0.06)), ((-x + 0.06, y - 0.06), (x - 0.1, y - 0.06)),
            ((x - 0.1, -y + 0.06), (-x + 0.06, -y + 0.06)))  # fmt: skip
    rails = [_bar(np.array((*a, 0.9)), np.array((*b, 0.9)), 0.015, RAIL) for a, b in ends]
    return joined([mesh_of(quads, paints), *rails])
