"""Markers of the test kit: what a test wants of its world, and sentences about wrong ones."""

from __future__ import annotations

import pytest

from roboglot.testing.requirements import Wanted, WantedFault, wanted_by


def test_the_nearest_marker_wins() -> None:
    mark = pytest.mark
    markers = (mark.seed(3), mark.world("empty", robots=["a", "b"], seed=7), mark.fault("low_battery", charge=0.2))
    fault = WantedFault("low_battery", options=(("charge", 0.2),))
    assert wanted_by(mark.mark for mark in markers) == Wanted("empty", ("a", "b"), seed=3, faults=(fault,))


@pytest.mark.parametrize(
    ("mark", "why"),
    [
        (pytest.mark.world(robots=3), "robots must be a list, not a whole number"),
        (pytest.mark.world("empty", ("a", "b")), "world takes one value without a name, not 2"),
        (pytest.mark.world(speed="fast"), "speed must be a number, not text"),
        (pytest.mark.world(doors=5), "doors must be a dictionary, not a whole number"),
        (pytest.mark.body(), "body takes one value without a name, not 0"),
        (pytest.mark.body("hermes", seed=3), "body has no seed"),
        (pytest.mark.seed("a"), "seed must be a whole number, not text"),
        (pytest.mark.fault(), "fault takes one value without a name, not 0"),
    ],
)
def test_wrong_markers_are_refused_in_words(mark: pytest.MarkDecorator, why: str) -> None:
    with pytest.raises(ValueError, match=f"^{why}$"):
        wanted_by([mark.mark])
