"""Which places are rivals, when the map explains only a part of the scan at the best of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.model.geometry import Point, Pose

if TYPE_CHECKING:
    from roboglot.autonomy.slam.matcher import Candidate

POINTS = 100


def candidate(x: float, fitting: int, hidden: int, floating: int) -> Candidate:
    """A place at ``x`` where the map says that of 100 points; all of the known ones fit closely."""
    from roboglot.autonomy.slam.certainty import Look, Support
    from roboglot.autonomy.slam.matcher import Candidate, Match

    match = Match(Pose(x), np.eye(3) * 1e-4, 0.0, fitting, fitting + hidden + floating, POINTS)
    look = Look(0.0, 0, fitting / POINTS, hidden / POINTS, 0.0, 1.0, 1.0, 1.0, fitting / POINTS)
    return Candidate(match, Support(POINTS, fitting, hidden, floating), look)


@pytest.mark.parametrize(("unknown", "count"), [(0, 1), (8, 2)])
def test_what_the_map_does_not_know_speaks_for_rivals(
    unknown: int, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from roboglot.autonomy.slam import matcher
    from roboglot.autonomy.slam.evidence import EvidenceGrid
    from roboglot.autonomy.slam.scan_points import ScanPoints

    found = [candidate(0.0, POINTS - unknown, 0, 0), candidate(7.0, 90, 4, 5)]
    monkeypatch.setattr(matcher, "_candidates", lambda *_: found)
    scan = ScanPoints(np.zeros((1, 2)), np.ones(1, np.uint8), np.zeros((1, 2)), Point())
    assert len(matcher.places(EvidenceGrid(), scan, None)) == count
