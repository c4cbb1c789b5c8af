"""How people and robots look to a camera: turned shapes around their own origin, +x ahead. Knows no world."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from roboglot.simulation.body import Hull
from roboglot.simulation.camera_shapes import Mesh, Paint, Rgb, card, joined, turned

SHIRTS: tuple[Rgb, ...] = (
    (196, 60, 52),
    (46, 110, 180),
    (236, 178, 52),
    (70, 150, 90),
    (150, 90, 170),
    (225, 225, 220),
)
TROUSERS: tuple[Rgb, ...] = ((44, 52, 78), (70, 70, 74), (96, 76, 58), (34, 34, 38))
HAIR: tuple[Rgb, ...] = ((40, 28, 22), (96, 62, 34), (24, 24, 26), (170, 130, 70), (140, 140, 140))
SKIN: tuple[Rgb, ...] = ((236, 196, 168), (198, 150, 116), (128, 88, 64), (246, 212, 188))
ROBOTS: tuple[Rgb, ...] = ((240, 130, 40), (60, 150, 220), (110, 190, 80), (200, 80, 150), (230, 210, 70))
TALL = 1.75  # m: the height that a person's proportions are given for
WIDE = 0.22
HIP = 0.86
STRIDE = 0.72  # m
SWING = 0.42  # how far forward a leg goes per metre of its length


@lru_cache(maxsize=64)
def _upper_body(index: int) -> Mesh:
    shirt, skin = Paint(SHIRTS[index % len(SHIRTS)]), Paint(SKIN[index % len(SKIN)])
    hair, dark = Paint(HAIR[index % len(HAIR)]), Paint((30, 24, 24))
    parts = [
        turned([(0.15, 0.82, shirt), (0.165, 0.95, shirt), (0.17, 1.1, shirt), (0.205, 1.3, shirt),
                (0.19, 1.42, shirt), (0.09, 1.49, skin), (0.06, 1.5, skin), (0.055, 1.56, skin)], 12, flat=0.62),
        turned([(0.02, 1.53, skin), (0.07, 1.55, skin), (0.098, 1.62, skin), (0.098, 1.67, skin), (0.07, 1.73, skin),
                (0.02, 1.745, skin)], 10),
        turned([(0.1, 1.6, hair), (0.106, 1.67, hair), (0.08, 1.73, hair), (0.02, 1.752, hair)], 10).placed(
            -0.018, 0, 0, 0
        ),
    ]  # fmt: skip
    for side in (-1, 1):
        arm = [(0.03, 0.8, skin), (0.045, 0.9, shirt), (0.05, 1.15, shirt), (0.06, 1.36, shirt), (0.03, 1.43, shirt)]
        parts.append(turned(arm, 7).placed(0, side * 0.245, 0, 0))
        parts.append(card((0.101, side * 0.038, 1.645), 0.0, (0.024, 0.016), dark))
    parts.append(card((0.1, 0, 1.583), 0.0, (0.05, 0.01), Paint((150, 70, 66))))
    return joined(parts)


@lru_cache(maxsize=64)
def _legs(index: int) -> Mesh:
    """Left one first; both have the same number of quads."""
    cloth, shoe = Paint(TROUSERS[index % len(TROUSERS)]), Paint((28, 26, 26))
    profile = [(0.06, 0.0, shoe), (0.06, 0.07, cloth), (0.055, 0.1, cloth), (0.065, 0.45, cloth), (0.09, HIP, cloth)]
    left = turned(profile, 8).placed(0, 0.095, 0, 0)
    return joined([left, left.placed(0, -0.19, 0, 0)])


def person(index: int, height: float, radius: float, phase: float | None) -> Mesh:
    """Somebody; ``phase``: metres walked so far if walking, None when standing."""
    legs = _legs(index)
    corners = legs.corners
    if phase is not None:
        corners = corners.copy()
        swing = SWING * math.sin(math.pi * phase / STRIDE)
        half = len(corners) // 2
        corners[:half, :, 0] += swing * (HIP - corners[:half, :, 2])
        corners[half:, :, 0] -= swing * (HIP - corners[half:, :, 2])
    whole = joined([_upper_body(index), Mesh(corners, legs.mappings, legs.paints, legs.textures, legs.rooms)])
    scale = np.array((radius / WIDE, radius / WIDE, height / TALL))
    return Mesh(whole.corners * scale, whole.mappings, whole.paints, whole.textures, whole.rooms)


@lru_cache(maxsize=64)
def robot(index: int, hull: Hull, belly: float) -> Mesh:
    """A robot with its torso's underside ``belly`` m above the floor."""
    skin, dark = Paint(ROBOTS[index % len(ROBOTS)]), Paint((52, 54, 60))
    light, eye = Paint((232, 234, 236)), Paint((90, 240, 255), glows=True)
    radius, top = hull.radius, belly + hull.torso_height
    seam = belly + hull.torso_height * 0.7
    parts = [
        turned([(radius * 0.96, hull.clearance, dark), (radius, hull.clearance + hull.chassis_height, dark)], 20),
        turned([(radius, belly, light), (radius, seam, skin), (radius, top, skin)], 20),
        card((radius * 1.01, 0, belly + hull.torso_height * 0.36), 0.0, (radius * 0.9, hull.torso_height * 0.5), dark),
    ]
    for side in (-1, 1):
        at = (radius * 1.02, side * radius * 0.22, belly + hull.torso_height * 0.36)
        parts.append(card(at, 0.0, (radius * 0.16, hull.torso_height * 0.22), eye))
        for end in (-1, 1):
            foot = hull.clearance + hull.chassis_height
            if belly > foot:
                leg = turned([(0.03, foot, dark), (0.03, belly, dark)], 6)
                parts.append(leg.placed(end * radius * 0.6, side * radius * 0.6, 0, 0))
    return joined(parts)
