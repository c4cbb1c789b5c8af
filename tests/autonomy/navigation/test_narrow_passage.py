"""Corridors: walls on both sides over some length, reported once each; a doorway is none."""

import numpy as np

from roboglot.autonomy.navigation.narrow_passage import WIDE_AFTER, NarrowPassage


def walls(left, right, length=2.0):
    x = np.linspace(-length / 2, length / 2, 81)
    return np.concatenate([np.column_stack([x, np.full(81, left)]), np.column_stack([x, np.full(81, -right)])])


def test_each_corridor_is_reported_once():
    watch = NarrowPassage(0.2)
    assert watch.entered(walls(2.0, 2.0)) is None
    assert abs(watch.entered(walls(0.5, 0.4)) - 0.9) < 1e-6
    assert watch.entered(walls(0.4, 0.4)) is None
    for _ in range(WIDE_AFTER - 1):
        watch.entered(walls(2.0, 0.4))
    assert watch.entered(walls(0.4, 0.4)) is None  # a gap does not end the passage
    for _ in range(WIDE_AFTER):
        watch.entered(walls(2.0, 0.4))
    assert watch.entered(walls(0.4, 0.4)) is not None


def test_a_doorway_and_one_wall_are_none():
    watch = NarrowPassage(0.2)
    assert watch.entered(walls(0.4, 0.4, length=0.2)) is None
    assert watch.entered(walls(0.3, 9.0)) is None
    assert watch.entered(np.zeros((0, 2))) is None
