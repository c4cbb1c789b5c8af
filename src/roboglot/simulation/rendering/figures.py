"""Figures of people and robots for cameras: turned shapes around their own origin, +x ahead. Knows no world."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels.posing import SIDES, draw_person
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
    joined,
    paint_row,
    turned,
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
LIMBS = (  # the joints at its ends, radii there (m), cloth
    ("shoulder", "elbow", 0.058, 0.048, 0), ("elbow", "wrist", 0.046, 0.034, 0), ("hip", "knee", 0.092, 0.068, 1),
    ("knee", "ankle", 0.064, 0.048, 1),
)  # fmt: skip
HAND, FOOT, NECK = (0.038, 0.03, 0.08), (0.045, 0.035, 0.0), (0.06, 0.055, 0.0)  # radii, length (0: to the next joint)
RADII = np.array([(*limb[2:4], 0.0) for limb in LIMBS for _ in (0, 1)] + [HAND] * 2 + [FOOT] * 2 + [NECK])
TORSO = ((-0.16, 0.15, 0.10), (0.1, 0.165, 0.11), (0.5, 0.16, 0.11), (0.85, 0.195, 0.12), (1.03, 0.16, 0.09),
         (1.12, 0.05, 0.05))  # share of the way from hips to shoulders, half width, half depth  # fmt: skip
HEAD = ((-0.11, 0.05, 0.05), (-0.06, 0.08, 0.08), (0.01, 0.1, 0.1), (0.06, 0.097, 0.097), (0.11, 0.06, 0.06),
        (0.13, 0.012, 0.012))  # m above the ears  # fmt: skip
HAIR = ((-0.02, 0.1, 0.1), (0.06, 0.108, 0.108), (0.115, 0.07, 0.07), (0.138, 0.012, 0.012))
RINGS = np.array([len(profile) for profile in (TORSO, HEAD, HAIR)])
PROFILES = np.array([(*profile, *((0.0, 0.0, 0.0),) * (6 - len(profile))) for profile in (TORSO, HEAD, HAIR)])
HEEL, TOES, STRAIGHT = (-0.03, 0.0, -0.03), (0.13, 0.0, -0.04), (0.0, 0.0, 0.0)
CLOTHS = (*(limb[4] for limb in LIMBS for _ in range(6)), *(2,) * 6, *(4,) * 6, *(2,) * 3, *(0,) * 5, *(2,) * 5,
          *(3,) * 3)  # of the pieces between rings: limbs, hands, feet, neck, trunk, head, hair  # fmt: skip


def _share(**shares: float) -> list[float]:
    """Return how much of each of JOINTS is in a point; a name without a side means both."""
    row = dict.fromkeys(JOINTS, 0.0)
    for name, share in shares.items():
        sides = (name,) if name in row else (f"left_{name}", f"right_{name}")
        for side in sides:
            row[side] += share / len(sides)
    return [*row.values()]


def _points() -> tuple[Floats, Floats]:
    """Return shares of joints and offsets (m) of the points from which the kernel makes a person."""
    sides = ("left", "right")
    rows = [(_share(**{f"{side}_{limb[0]}": 1}), STRAIGHT) for limb in LIMBS for side in sides]
    rows += [(_share(**{f"{side}_wrist": 1}), STRAIGHT) for side in sides]
    rows += [(_share(**{f"{side}_ankle": 1}), HEEL) for side in sides]
    rows.append((_share(shoulder=1), STRAIGHT))
    rows += [(_share(**{f"{side}_{limb[1]}": 1}), STRAIGHT) for limb in LIMBS for side in sides]
    rows += [(_share(**{f"{side}_wrist": 2, f"{side}_elbow": -1}), STRAIGHT) for side in sides]
    rows += [(_share(**{f"{side}_ankle": 1}), TOES) for side in sides]
    rows.append((_share(ear=1), STRAIGHT))
    others = (
        {"hip": 1}, {"shoulder": 1, "hip": -1}, {"left_shoulder": 1, "right_shoulder": -1}, {"ear": 1},
        {"left_ear": 1, "right_ear": -1}, {"nose": 1, "ear": -1}, {"ear": 1.18, "nose": -0.18}, {"left_eye": 1},
        {"right_eye": 1},
    )  # fmt: skip
    rows += [(_share(**shares), STRAIGHT) for shares in others]
    return np.array([shares for shares, _ in rows]), np.array([off for _, off in rows])


MIXING, OFFSETS = _points()
QUADS = SIDES * len(CLOTHS) + 2  # of a person: the last are the eyes


def person(index: int, joints: Floats) -> Mesh:
    """Return a person with these JOINTS (own frame, x ahead; m); ``index`` chooses clothes, hair and skin."""
    return posing(index, np.asarray(joints, np.float64).tobytes())


@lru_cache(maxsize=16)
def posing(index: int, packed: bytes) -> Mesh:
    """Return the same by the bytes of the joints, cached: a standing person looks the same in the next picture."""
    joints, corners = np.frombuffer(packed).reshape(-1, 3), np.empty((QUADS, 4, 3))
    draw_person(joints.copy(), MIXING, OFFSETS, RADII, PROFILES, RINGS, corners)
    return Mesh(corners, *_look(index))


@lru_cache(maxsize=64)
def _look(index: int) -> tuple[Floats, NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:
    """Return the constant part of a person's look: mappings, paints, textures and rooms."""
    colours = (SHIRTS[index % len(SHIRTS)], TROUSERS[index % len(TROUSERS)], SKIN[index % len(SKIN)],
               HAIRS[index % len(HAIRS)], (28, 26, 26))  # fmt: skip
    rows = [paint_row(Paint(colours[cloth]), 1.0) for cloth in CLOTHS for _ in range(SIDES)]
    rows += [paint_row(Paint((30, 24, 24)), 1.0)] * (QUADS - len(rows))
    paints = np.array(rows, dtype=np.float32)
    return np.zeros((QUADS, 3, 3)), paints, np.full(QUADS, FLAT, np.int32), np.full(QUADS, EVERYWHERE, np.int32)


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
