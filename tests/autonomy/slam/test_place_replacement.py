"""A distant place that fits better replaces the believed one only when a second search finds it, too."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from roboglot.autonomy.slam.matcher import Match
from roboglot.autonomy.slam.recovery.whole_map_search import PlaceReplacement
from roboglot.model.geometry import Pose

BELIEVED, MIRRORED, NEARBY = Pose(2.9, 2.6), Pose(4.5, 3.4, math.pi), Pose(3.5, 2.6)
START = Pose()  # by odometry
MAP = object()


def fitting(pose: Pose, agreement: float = 0.85) -> Match:
    """Return a match in which this share of a thousand known points fits."""
    return Match(pose, np.eye(3), 0.0, round(1000 * agreement), 1000, 1000)


def replaces(
    replacement: PlaceReplacement, found: Match, odometry: Pose = START, *, given: bool = False, stood: bool = True
) -> bool:
    """Return whether it replaces the believed place of a robot that believed to be at BELIEVED when odometry began."""
    belief: Any = SimpleNamespace(map_to_odom=BELIEVED, map=MAP)
    return replacement.replaces(found, odometry, belief, 0.7, given=given, stood=stood)


@pytest.fixture
def replacement() -> PlaceReplacement:
    """Return the memory of a robot whose scans fitted."""
    made = PlaceReplacement()
    made.note_fit(MAP)
    return made


def test_one_search_counts_on_an_unknown_map() -> None:
    assert replaces(PlaceReplacement(), fitting(MIRRORED))


def test_a_distant_place_has_to_be_found_twice(replacement: PlaceReplacement) -> None:
    assert not replaces(replacement, fitting(MIRRORED))
    assert replaces(replacement, fitting(MIRRORED))


def test_the_place_moves_with_the_robot(replacement: PlaceReplacement) -> None:
    step = Pose(0.5, 0.0, 0.3)
    # The wheels' step happens in the frame of the odometry, which begins at the first of both places.
    assert not replaces(replacement, fitting(MIRRORED))
    assert replaces(replacement, fitting(MIRRORED.compose(step)), step)


@pytest.mark.parametrize("other", [Pose(4.5, 3.4, 0.0), Pose(5.5, 3.4, math.pi)], ids=["turned", "moved"])
def test_another_place_begins_anew(replacement: PlaceReplacement, other: Pose) -> None:
    assert not replaces(replacement, fitting(MIRRORED))
    assert not replaces(replacement, fitting(other))
    assert not replaces(replacement, fitting(MIRRORED))


def test_a_fit_in_between_begins_anew(replacement: PlaceReplacement) -> None:
    assert not replaces(replacement, fitting(MIRRORED))
    replacement.note_fit(MAP)
    assert not replaces(replacement, fitting(MIRRORED))


def test_a_place_that_fits_little_better_never_counts(replacement: PlaceReplacement) -> None:
    assert not any(replaces(replacement, fitting(MIRRORED, 0.77)) for _ in range(3))


@pytest.mark.parametrize(
    ("given", "stood", "counts"), [(True, False, True), (False, True, True), (False, False, False)]
)
def test_a_place_nearby_counts_at_once(
    replacement: PlaceReplacement, *, given: bool, stood: bool, counts: bool
) -> None:
    assert replaces(replacement, fitting(NEARBY), given=given, stood=stood) is counts


def test_a_given_pose_yields_to_no_distant_one(replacement: PlaceReplacement) -> None:
    assert not any(replaces(replacement, fitting(MIRRORED), given=True) for _ in range(3))
