"""Moving quads of a picture: turned, moved, lit and with a shadow as plain arithmetic has it."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.posing import SUN, darken, pose
from roboglot.simulation.bodies.hull import rotation


def test_quads_follow_their_owners_and_are_lit():
    rng = np.random.default_rng(3)
    corners, mappings = rng.normal(size=(40, 4, 3)), rng.normal(size=(40, 3, 3))
    paints = rng.random((40, 8)).astype(np.float32)
    paints[:, 7] = np.arange(40) % 4 > 0  # every fourth glows
    owners = np.repeat(np.arange(4, dtype=np.int32), 10)
    turns, places = [rotation((0.1 * n, -0.2 * n), 1.5 * n) for n in range(4)], rng.normal(size=(4, 3))
    poses = np.array([[*turn.ravel(), *place] for turn, place in zip(turns, places, strict=True)])
    before = corners.copy(), mappings.copy(), paints.copy()
    pose(corners, mappings, paints, owners, poses)
    sun = np.array(SUN) / np.linalg.norm(SUN)
    for quad, owner in enumerate(owners):
        turned = before[0][quad] @ turns[owner].T + places[owner]
        np.testing.assert_allclose(corners[quad], turned)
        np.testing.assert_allclose(mappings[quad, 0], turns[owner] @ before[1][quad, 0] + places[owner])
        np.testing.assert_allclose(mappings[quad, 1:], before[1][quad, 1:] @ turns[owner].T)
        normal = np.cross(turned[1] - turned[0], turned[2] - turned[0])
        normal /= np.linalg.norm(normal)
        light = 0.86 + 0.10 * normal[2] + 0.20 * max(-0.6, float(normal @ sun))
        np.testing.assert_allclose(paints[quad, 6], light if paints[quad, 7] else before[2][quad, 6], rtol=1e-6)
    np.testing.assert_array_equal(paints[:, :6], before[2][:, :6])


def test_shadows_lie_under_discs():
    shadows = np.full((30, 40), 200, np.uint8)
    darken(shadows, np.array(((2.0, 1.5, 0.4), (50.0, 1.0, 0.4), (0.0, 0.0, 0.3))), 0.0, 0.0, 0.1, 0.3)
    ys, xs = (np.indices(shadows.shape) + 0.5) * 0.1
    wanted = np.full(shadows.shape, 200, np.uint8)
    for x, y, radius in ((2.0, 1.5, 0.4), (0.0, 0.0, 0.3)):
        reach = radius + 0.3
        dark = 0.6 * np.clip((reach - np.hypot(xs - x, ys - y)) / (reach - 0.5 * radius), 0.0, 1.0)
        wanted = (wanted * (1.0 - dark)).astype(np.uint8)
    assert np.abs(shadows.astype(int) - wanted).max() <= 1
    assert shadows.min() < 90
