"""Figures of people and robots for cameras: turned shapes around their own origin, +x ahead. Knows no world."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from roboglot.model.perception import JOINTS
from roboglot.simulation.bodies.body import HullSection
from roboglot.simulation.rendering.shapes import (
    EVERYWHERE,
    FLAT,
    Floats,
    Mesh,
    Paint,
    Rgb,
    card,
    cross,
    joined,
    paint_row,
    turned,
    unit,
)

SHIRTS: tuple[Rgb, ...] = (
    (196, 60, 52),
    (46, 110, 180),
    (236, 178, 52),
    (70, 150, 90),
    (150, 90, 170),
    (225, 225, 220),
)
TROUSERS: tuple[Rgb, ...] = ((44, 52, 78), (70, 70, 74), (96, 76, 58), (34, 34, 38))
HAIRS: tuple[Rgb, ...] = ((40, 28, 22), (96, 62, 34), (24, 24, 26), (170, 130, 70), (140, 140, 140))
SKIN: tuple[Rgb, ...] = ((236, 196, 168), (198, 150, 116), (128, 88, 64), (246, 212, 188))
ROBOTS: tuple[Rgb, ...] = ((240, 130, 40), (60, 150, 220), (110, 190, 80), (200, 80, 150), (230, 210, 70))
SIDES = 8
LIMBS = (  # the joints at its ends, radii there (m), cloth
    ("shoulder", "elbow", 0.058, 0.048, 0), ("elbow", "wrist", 0.046, 0.034, 0), ("hip", "knee", 0.092, 0.068, 1),
    ("knee", "ankle", 0.064, 0.048, 1),
)  # fmt: skip
HAND, FOOT, NECK = (0.038, 0.03, 2), (0.045, 0.035, 4), (0.06, 0.055, 2)
RADII = np.array([limb[2:] for limb in LIMBS for _ in (0, 1)] + [HAND] * 2 + [FOOT] * 2 + [NECK])
TORSO = np.array(((-0.16, 0.15, 0.10), (0.1, 0.165, 0.11), (0.5, 0.16, 0.11), (0.85, 0.195, 0.12), (1.03, 0.16, 0.09),
                  (1.12, 0.05, 0.05)))  # share of the way from hips to shoulders, half width, half depth  # fmt: skip
HEAD = np.array(((-0.11, 0.05, 0.05), (-0.06, 0.08, 0.08), (0.01, 0.1, 0.1), (0.06, 0.097, 0.097), (0.11, 0.06, 0.06),
                 (0.13, 0.012, 0.012)))  # m above the ears  # fmt: skip
HAIR = np.array(((-0.02, 0.1, 0.1), (0.06, 0.108, 0.108), (0.115, 0.07, 0.07), (0.138, 0.012, 0.012)))
HEEL, TOES = np.array((-0.03, 0.0, -0.03)), np.array((0.13, 0.0, -0.04))
WHERE = {name: number for number, name in enumerate(JOINTS)}
STARTS, ENDS = (
    np.array([WHERE[f"{side}_{limb[end]}"] for limb in LIMBS for side in ("left", "right")]) for end in (0, 1)
)
LEFT, RIGHT = (
    np.array([WHERE[f"{side}_{part}"] for part in ("wrist", "ankle", "elbow")]) for side in ("left", "right")
)
CLOTHS = tuple(int(cloth) for cloth in RADII[:, 2].repeat(3)) + (0,) * 5 + (2,) * 5 + (3,) * 3


def person(index: int, joints: Floats) -> Mesh:
    """Return a person with these JOINTS (own frame, x ahead; m); ``index`` chooses clothes, hair and skin."""
    return posing(index, np.asarray(joints, np.float64).tobytes())


@lru_cache(maxsize=16)
def posing(index: int, packed: bytes) -> Mesh:
    """Return the same by the bytes of the joints, cached: a standing person looks the same in the next picture."""
    joints = np.frombuffer(packed).reshape(-1, 3)
    wrists, ankles, elbows = (joints[[LEFT[part], RIGHT[part]]] for part in range(3))
    shoulders, hips, ears = (_between(joints, part) for part in ("shoulder", "hip", "ear"))
    starts = np.concatenate((joints[STARTS], wrists, ankles + HEEL, shoulders[None]))
    ends = np.concatenate((joints[ENDS], wrists + 0.08 * unit(wrists - elbows), ankles + TOES, ears[None]))
    left = joints[WHERE["left_shoulder"]] - joints[WHERE["right_shoulder"]]
    ear, face = joints[WHERE["left_ear"]] - joints[WHERE["right_ear"]], joints[WHERE["nose"]] - ears
    up = unit(cross(face, ear))
    pieces = np.concatenate(
        (
            _tapering(starts, ends),
            _tube(hips, shoulders - hips, left, TORSO),
            _tube(ears, up, ear, HEAD),
            _tube(ears - 0.18 * face, up, ear, HAIR),
        )
    )
    corners = np.concatenate((_skin(pieces), _eyes(joints, face, ear, up)))
    return Mesh(corners, *_look(index, len(corners)))


def _skin(pieces: Floats) -> Floats:
    """Return quads, SIDES around each piece (6 x 3): middle, across and depth of the ring at each end."""
    angles = np.arange(SIDES + 1) * (math.tau / SIDES)
    c, s = np.cos(angles)[None, :, None], np.sin(angles)[None, :, None]
    low, high = (pieces[:, None, i] + c * pieces[:, None, i + 1] + s * pieces[:, None, i + 2] for i in (0, 3))
    quads: Floats = np.stack((low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]), axis=2)
    return quads.reshape(-1, 4, 3)


def _tapering(starts: Floats, ends: Floats) -> Floats:
    """Return the pieces of limbs with closed ends, three per limb."""
    axes = unit(ends - starts)
    aside = np.where(np.abs(axes[:, :1]) < 0.8, (1.0, 0.3, 0.1), (0.0, 1.0, 0.2))
    across = unit(cross(axes, aside))
    depth = cross(axes, across)
    first, last = RADII[:, :1], RADII[:, 1:2]
    middles = np.stack((starts - 0.5 * first * axes, starts, ends, ends + 0.5 * last * axes), axis=1)
    sizes = np.stack((0.08 * first, first, last, 0.08 * last), axis=1)
    rings = np.stack((middles, sizes * across[:, None], sizes * depth[:, None]), axis=2)
    return np.concatenate((rings[:, :-1], rings[:, 1:]), axis=2).reshape(-1, 6, 3)


def _tube(foot: Floats, axis: Floats, left: Floats, profile: Floats) -> Floats:
    """Return the pieces of a tube along ``axis`` from ``foot`` on, its width to the ``left``."""
    ahead = unit(cross(left, axis))
    across = unit(cross(axis, ahead))
    rings = np.stack((foot + profile[:, :1] * axis, profile[:, 2:] * ahead, profile[:, 1:2] * across), axis=1)
    return np.concatenate((rings[:-1], rings[1:]), axis=1)


def _between(joints: Floats, part: str) -> Floats:
    middle: Floats = (joints[WHERE[f"left_{part}"]] + joints[WHERE[f"right_{part}"]]) / 2
    return middle


def _eyes(joints: Floats, face: Floats, ear: Floats, up: Floats) -> Floats:
    """Return two dark squares in front of the skin, facing ahead."""
    ahead, left = unit(face), unit(ear)
    quads = []
    for side in ("left_eye", "right_eye"):
        at = joints[WHERE[side]] + 0.016 * ahead
        x, y = 0.012 * left, 0.009 * up
        quads.append((at - x - y, at + x - y, at + x + y, at - x + y))
    return np.array(quads)


@lru_cache(maxsize=64)
def _look(index: int, count: int) -> tuple[Floats, NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:
    """Return the constant part of a person's look: mappings, paints, textures and rooms."""
    colours = (SHIRTS[index % len(SHIRTS)], TROUSERS[index % len(TROUSERS)], SKIN[index % len(SKIN)],
               HAIRS[index % len(HAIRS)], (28, 26, 26))  # fmt: skip
    rows = [paint_row(Paint(colours[cloth]), 1.0) for cloth in CLOTHS for _ in range(SIDES)]
    rows += [paint_row(Paint((30, 24, 24)), 1.0)] * (count - len(rows))
    paints = np.array(rows, dtype=np.float32)
    return np.zeros((count, 3, 3)), paints, np.full(count, FLAT, np.int32), np.full(count, EVERYWHERE, np.int32)


@lru_cache(maxsize=64)
def can(index: int, diameter: float, height: float) -> Mesh:
    """Return a small can with a bright rim."""
    radius, label, tin = diameter / 2, Paint(SHIRTS[index % len(SHIRTS)]), Paint((190, 194, 198))
    profile = [(radius, 0.0, tin), (radius, 0.1 * height, label), (radius, 0.9 * height, tin), (radius, height, tin)]
    return turned(profile, 12)


@lru_cache(maxsize=64)
def robot(index: int, hull: HullSection, belly: float, walks: bool = False) -> Mesh:
    """Return a robot with its torso's underside ``belly`` m above the floor; legs for walking are fittings."""
    skin, dark = Paint(ROBOTS[index % len(ROBOTS)]), Paint((52, 54, 60))
    light, eye = Paint((232, 234, 236)), Paint((90, 240, 255), glows=True)
    radius, top = hull.radius, belly + hull.torso_height
    seam = belly + hull.torso_height * 0.7
    skirt = [(radius * 0.96, hull.clearance, dark), (radius, hull.clearance + hull.chassis_height, dark)]
    parts = [
        *([] if walks else [turned(skirt, 20)]),
        turned([(radius, belly, light), (radius, seam, skin), (radius, top, skin)], 20),
        card((radius * 1.01, 0, belly + hull.torso_height * 0.36), 0.0, (radius * 0.9, hull.torso_height * 0.5), dark),
    ]
    for side in (-1, 1):
        at = (radius * 1.02, side * radius * 0.22, belly + hull.torso_height * 0.36)
        parts.append(card(at, 0.0, (radius * 0.16, hull.torso_height * 0.22), eye))
        for end in (-1, 1):
            foot = hull.clearance + hull.chassis_height
            if belly > foot and not walks:
                leg = turned([(0.03, foot, dark), (0.03, belly, dark)], 6)
                parts.append(leg.placed(end * radius * 0.6, side * radius * 0.6, 0, 0))
    return joined(parts)
