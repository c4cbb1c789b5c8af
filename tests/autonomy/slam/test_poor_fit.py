"""A contradicted robot whose scans go on fitting poorly is lost, though the map contradicts none of them any more."""

from __future__ import annotations

from typing import cast

import pytest

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.certainty import Support
from roboglot.autonomy.slam.recovery.whereabouts import POOR_SECONDS, Whereabouts
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import EventStream, LostReason

DENIED, POOR, FAIR, GOOD, NEW = (
    Support(100, 5, 50, 45),
    Support(100, 63, 5, 32),
    Support(100, 75, 5, 20),
    Support(100, 95, 1, 4),
    Support(100, 5, 1, 4),
)


@pytest.fixture
def whereabouts() -> Whereabouts:
    made = Whereabouts(Belief(odometry=cast(Odometry, None)), EventStream())
    made.begin()
    return made


def lost_at(whereabouts: Whereabouts, *seen: Support, period: float = 0.25) -> float | None:
    """Return the time (s) after which the robot is lost, as scans come; the last kind comes for ten seconds."""
    scans = [*seen[:-1], *[seen[-1]] * round(10.0 / period)]
    for number, support in enumerate(scans):
        whereabouts.judge(support, number * period)
        if whereabouts._belief.lost is LostReason.NO_FIT:
            return number * period
    return None


def test_a_contradiction_and_a_poor_fit_lose_it(whereabouts: Whereabouts) -> None:
    """In an aisle that looks half alike, a kidnapped robot drove on for 16 s."""
    whereabouts.judge(DENIED, 0.0)
    whereabouts.judge(POOR, 0.25)
    assert not whereabouts._belief.is_certain  # no drive succeeds
    assert lost_at(whereabouts, POOR) == POOR_SECONDS


def test_a_poor_fit_alone_is_none(whereabouts: Whereabouts) -> None:
    assert lost_at(whereabouts, POOR) is None


@pytest.mark.parametrize("between", [FAIR, NEW], ids=["fair", "new ground"])
def test_a_better_fit_ends_it(whereabouts: Whereabouts, between: Support) -> None:
    assert lost_at(whereabouts, DENIED, POOR, between, POOR) is None
    assert whereabouts._belief.is_certain


@pytest.mark.parametrize(
    ("seen", "reason"),
    [(GOOD, LostReason.NO_SCANS), (POOR, LostReason.NO_FIT), (NEW, LostReason.NO_GROUND)],
    ids=["good", "poor", "new ground"],
)
def test_a_lidar_that_returns_is_not_silent(whereabouts: Whereabouts, seen: Support, reason: LostReason) -> None:
    whereabouts.lose(LostReason.NO_SCANS, 10.0)
    whereabouts.judge(seen, 20.0)
    assert whereabouts._belief.lost is reason
