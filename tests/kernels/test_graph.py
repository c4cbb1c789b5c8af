"""Pose graphs against the truth that they were made from."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.graph import relaxed


def relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    c, s = np.cos(a[2]), np.sin(a[2])
    dx, dy, turn = b - a
    return np.array([c * dx + s * dy, -s * dx + c * dy, np.arctan2(np.sin(turn), np.cos(turn))])


def moved(a: np.ndarray, by: np.ndarray) -> np.ndarray:
    c, s = np.cos(a[2]), np.sin(a[2])
    return np.array([a[0] + c * by[0] - s * by[1], a[1] + s * by[0] + c * by[1], a[2] + by[2]])


def test_two_rounds_are_straightened_by_shared_sightings() -> None:
    draw, count = np.random.default_rng(1), 400
    angle = np.linspace(0, 4 * np.pi, count)
    truth = np.stack([10 * np.cos(angle), 10 * np.sin(angle), angle + np.pi / 2], axis=1)
    drifted, pairs, measured, weights = [truth[0]], [], [], []
    for i in range(count - 1):
        step = relative(truth[i], truth[i + 1]) + draw.normal(0.002, (0.005, 0.005, 0.002))
        drifted.append(moved(drifted[-1], step))
        pairs.append((i, i + 1))
        measured.append(step)
        weights.append((4e4, 4e4, 2.5e5))
    for i in range(0, count // 2, 10):
        pairs.append((i, i + count // 2))
        measured.append(relative(truth[i], truth[i + count // 2]))
        weights.append((1e6, 1e6, 1e6))
    start = np.array(drifted)
    pairs_array, measures, weights_array = np.array(pairs, np.int32), np.array(measured), np.array(weights)
    found = relaxed(start, pairs_array, measures, weights_array, 30)
    before, after = (np.hypot(*(poses - truth)[:, :2].T).max() for poses in (start, found))
    assert before > 2.0
    assert after < 0.25 * before
    assert np.array_equal(found[0], truth[0])
    seen_twice = np.hypot(*(found[count // 2 :] - found[: count // 2])[::10, :2].T) - np.hypot(
        *(truth[count // 2 :] - truth[: count // 2])[::10, :2].T
    )
    assert np.abs(seen_twice).max() < 0.02


def test_consistent_poses_stay() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, np.pi / 2], [1.0, 1.0, np.pi]])
    pairs = np.array([(0, 1), (1, 2)], np.int32)
    measured = np.array([relative(poses[i], poses[j]) for i, j in pairs])
    assert np.allclose(relaxed(poses, pairs, measured, np.ones((2, 3)), 5), poses, atol=1e-9)
