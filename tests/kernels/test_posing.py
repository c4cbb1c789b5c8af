"""Moving quads of a picture: turned, moved, lit and with a shadow as plain arithmetic has it."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.posing import SIDES, SUN, darken, pose
from roboglot.model.perception import JOINTS
from roboglot.simulation.bodies.hull import rotation
from roboglot.simulation.rendering.figures import HAIR, HEAD, LIMBS, QUADS, TORSO, person

STANDING = {"nose": (0.1, 0, 1.6), "eye": (0.09, 0.03, 1.63), "ear": (0, 0.08, 1.6), "shoulder": (0, 0.2, 1.4),
            "elbow": (0.1, 0.25, 1.1), "wrist": (0.3, 0.25, 1.0), "hip": (0, 0.1, 0.9), "knee": (0.1, 0.1, 0.5),
            "ankle": (0, 0.1, 0.08)}  # the left ones  # fmt: skip


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


def someone(rng):
    """Joints of a person in some posture, by their names."""
    places = {}
    for name in JOINTS:
        x, y, z = STANDING[name.removeprefix("left_").removeprefix("right_")]
        places[name] = np.array((x, -y if name.startswith("right_") else y, z)) + rng.normal(0, 0.05, 3)
    return places


def ring(quads, upper):
    """The corners of a ring, from the quads around a piece."""
    return quads[:, 3] if upper else quads[:, 0]


def test_limbs_are_round_between_their_joints():
    rng = np.random.default_rng(5)
    for _ in range(5):
        joints = someone(rng)
        mesh = person(0, np.array([*joints.values()]))
        assert [len(part) for part in (mesh.corners, mesh.paints, mesh.mappings)] == [QUADS] * 3
        number = 0
        for from_, to, low, high, _cloth in LIMBS:
            for side in ("left_", "right_"):
                start, end = joints[side + from_], joints[side + to]
                piece = mesh.corners[SIDES * (3 * number + 1) :][:SIDES]  # between both ends, which are closed
                for upper, middle, radius in ((False, start, low), (True, end, high)):
                    np.testing.assert_allclose(np.linalg.norm(ring(piece, upper) - middle, axis=1), radius)
                    np.testing.assert_allclose((ring(piece, upper) - middle) @ (end - start), 0.0, atol=1e-12)
                number += 1
        for side in ("left_", "right_"):  # hands reach on where the lower arm points
            wrist, elbow = joints[side + "wrist"], joints[side + "elbow"]
            tip = ring(mesh.corners[SIDES * (3 * number + 1) :][:SIDES], upper=True).mean(axis=0)
            np.testing.assert_allclose(tip, wrist + 0.08 * (wrist - elbow) / np.linalg.norm(wrist - elbow))
            number += 1


def test_trunk_head_and_hair_follow_spine_and_face():
    rng = np.random.default_rng(6)
    joints = someone(rng)
    corners = person(0, np.array([*joints.values()])).corners
    hips, shoulders, ears = (
        (joints[f"left_{part}"] + joints[f"right_{part}"]) / 2 for part in ("hip", "shoulder", "ear")
    )
    face, ear = joints["nose"] - ears, joints["left_ear"] - joints["right_ear"]
    up = np.cross(face, ear) / np.linalg.norm(np.cross(face, ear))
    first = SIDES * 3 * 13
    for profile, foot, axis in ((TORSO, hips, shoulders - hips), (HEAD, ears, up), (HAIR, ears - 0.18 * face, up)):
        for number, (share, width, depth) in enumerate(profile[:-1]):
            piece = ring(corners[first + SIDES * number :][:SIDES], upper=False)
            np.testing.assert_allclose(piece.mean(axis=0), foot + share * axis)
            sizes = np.linalg.norm(piece - piece.mean(axis=0), axis=1)
            np.testing.assert_allclose(sizes[[0, 2, 4, 6]], [depth, width] * 2)
        first += SIDES * (len(profile) - 1)
    for side, eye in zip(("left", "right"), corners[first:], strict=True):
        np.testing.assert_allclose(eye.mean(axis=0), joints[f"{side}_eye"] + 0.016 * face / np.linalg.norm(face))


def test_people_are_seen_from_outside():
    rng = np.random.default_rng(7)
    corners = person(0, np.array([*someone(rng).values()])).corners
    pieces = corners[:-2].reshape(-1, SIDES, 4, 3)
    normals = np.cross(pieces[:, :, 1] - pieces[:, :, 0], pieces[:, :, 2] - pieces[:, :, 0])
    out = pieces.mean(axis=2) - pieces.mean(axis=(1, 2))[:, None]
    assert ((normals * out).sum(axis=-1) > 0).all()
