"""Rival places, when the map explains only a part of the scan at the best of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.model.geometry import Point, Pose

if TYPE_CHECKING:
    from roboglot.autonomy.slam.matcher import Candidate

POINTS = 100


def candidate(x: float, fitting: int, hidden: int, floating: int) -> Candidate:
    """Return a place at ``x`` where the map says that of 100 points; all of the known ones fit closely."""
    from roboglot.autonomy.slam.certainty import Look, Support
    from roboglot.autonomy.slam.matcher import Candidate, Match

    match = Match(Pose(x), np.eye(3) * 1e-4, 0.0, fitting, fitting + hidden + floating, POINTS)
    look = Look(0.0, 0, fitting / POINTS, hidden / POINTS, 0.0, 1.0, 1.0, 1.0, fitting / POINTS, 0.0)
    return Candidate(match, Support(POINTS, fitting, hidden, floating), look)


@pytest.mark.parametrize(("unknown", "count"), [(0, 1), (8, 2)])
def test_unknown_points_leave_rival_places_open(unknown: int, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from roboglot.autonomy.slam import matcher
    from roboglot.autonomy.slam.evidence import EvidenceGrid
    from roboglot.autonomy.slam.scan_points import ScanPoints

    found = [candidate(0.0, POINTS - unknown, 0, 0), candidate(7.0, 90, 4, 5)]
    monkeypatch.setattr(matcher, "_candidates", lambda *_: (found, True))
    scan = ScanPoints(np.zeros((1, 2)), np.ones(1, np.uint8), np.zeros((1, 2)), Point())
    assert len(matcher.places(EvidenceGrid(), scan, None)) == count


@pytest.mark.parametrize(("fitting", "count"), [(POINTS, 0), (82, 1)])
def test_region_loses_to_a_better_place_elsewhere(fitting: int, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The only place in a region was believed, although the scan showed another room of the same shape."""
    from roboglot.autonomy.slam import matcher
    from roboglot.autonomy.slam.evidence import EvidenceGrid
    from roboglot.autonomy.slam.scan_points import ScanPoints
    from roboglot.model.components.mapping.localization import Region

    inside, outside = (
        candidate(7.0, 82, 9, 9),
        candidate(0.0, fitting, (POINTS - fitting) // 2, (POINTS - fitting) // 2),
    )
    monkeypatch.setattr(matcher, "_candidates", lambda _, __, region, ___: ([inside] if region else [outside], True))
    scan = ScanPoints(np.zeros((1, 2)), np.ones(1, np.uint8), np.zeros((1, 2)), Point())
    found = matcher.places(EvidenceGrid(), scan, Region(5.0, -1.0, 9.0, 1.0))
    assert found == [inside.match][:count]


@pytest.mark.parametrize("complete", [True, False])
def test_best_rival_is_believed_if_all_were_examined(complete: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    from roboglot.autonomy.slam import matcher
    from roboglot.autonomy.slam.evidence import EvidenceGrid
    from roboglot.autonomy.slam.scan_points import ScanPoints

    found, looks = [candidate(0.0, POINTS, 0, 0), candidate(7.0, 85, 10, 5)], list[int]()

    def look(grid: object, scan: object, region: object, most: int) -> tuple[list[Candidate], bool]:
        looks.append(most)
        return found, complete

    monkeypatch.setattr(matcher, "_candidates", look)
    scan = ScanPoints(np.zeros((1, 2)), np.ones(1, np.uint8), np.zeros((1, 2)), Point())
    assert len(matcher.places(EvidenceGrid(), scan, None)) == (1 if complete else 2)
    assert looks == ([matcher.PLACES_MAX] if complete else [matcher.PLACES_MAX, matcher.PLACES_TRIED])


def test_echo_seen_through_wall_speaks_against_a_place() -> None:
    """Two walls behind each other: the farther one explains no echo while the nearer one stands in the way."""
    from roboglot.kernels.occupancy import CROSSING, FITTING, verdicts

    evidence = np.full((60, 60), -500, np.int16)
    evidence[:, 50] = 500
    points = np.array([[2.52, 1.5], [2.52, 0.9], [2.52, 2.1]])
    assert verdicts(evidence, points, 0.5, 1.5, 0.15, 0.05).tolist() == [FITTING] * 3
    evidence[24:36, 30] = 500  # as wide as the middle ray needs; the others miss it
    assert verdicts(evidence, points, 0.5, 1.5, 0.15, 0.05).tolist() == [CROSSING, FITTING, FITTING]
