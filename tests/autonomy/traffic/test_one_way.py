"""One-way stretches: a robot stays out of a corridor through which another comes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from roboglot.autonomy.traffic.one_way import OneWayStretches
from roboglot.autonomy.traffic.right_of_way import Meeting, Way, announced_way, meetings
from roboglot.model.components.logistics.traffic_radio import Announcement
from roboglot.model.geometry import Point, Pose

RADIUS = 0.25
EAST = np.stack([np.arange(0.0, 12.0, 0.05), np.zeros(240)], axis=1)  # 12 m along x
CORRIDOR = (EAST[:, 0] >= 2.0) & (EAST[:, 0] < 8.0)


def west(start: float, *, metres: float = 6.0, speed: float = 0.5, outranks: bool = False, name: str = "b") -> Way:
    """Return the way of a robot that comes the other way."""
    points = np.stack([np.arange(start, start - metres, -0.2), np.zeros(round(metres / 0.2))], axis=1)
    return Way(points, speed, RADIUS, outranks, name)


def meeting(way: Way, narrow: NDArray[np.bool_] = CORRIDOR, seconds: float = 0.0) -> Meeting | None:
    stretches = OneWayStretches()
    stretches.observe([way], 0.0)
    stretches.observe([Way(way.points, 0.0, RADIUS, way.outranks, way.name)] if seconds else [way], seconds)
    return stretches.meeting(EAST, lambda: narrow, 0.5, RADIUS, [way], seconds)


def test_first_one_in_goes_first() -> None:
    found = meeting(west(7.5))
    assert found is not None
    assert found.along == pytest.approx(2.0, abs=0.06)
    assert not found.stands_in_it


def test_rule_decides_between_two_that_arrive_together() -> None:
    assert meeting(west(10.0, outranks=True)) is not None
    assert meeting(west(10.0, outranks=False)) is None


def test_one_that_arrives_first_goes_first() -> None:
    assert meeting(west(8.6, outranks=False)) is not None


@pytest.mark.parametrize(
    "way",
    [
        west(1.5, metres=1.0),  # came out
        west(10.5, metres=1.0),  # turns off before it
        Way(EAST[::4] + np.array((4.0, 0.0)), 0.5, RADIUS, outranks=True, name="b"),  # drives ahead
    ],
)
def test_others_hold_up_no_one(way: Way) -> None:
    assert meeting(way) is None


@pytest.mark.parametrize("gone", [0.0, 0.1, 0.2, 0.35])
def test_one_ahead_in_a_corridor_is_followed(gone: float) -> None:
    """It announces the way that it planned at the last scan, and has driven a little since."""
    way = tuple(Point(4.0 + 0.2 * n, 0.0) for n in range(25))
    other = Announcement("b", "map", 0.0, Pose(4.0 + gone, 0.0), 0.5, RADIUS, way=way, inside=True)
    coming = announced_way(other, Announcement("a", "map", 0.0, Pose(), 0.5, RADIUS))
    assert coming.outranks
    assert (np.diff(coming.points[:, 0]) > 0.0).all()
    assert meeting(coming) is None
    assert list(meetings(EAST[60:], 0.5, RADIUS, [coming])) == []


def test_robot_inside_drives_on() -> None:
    assert meeting(west(6.0), EAST[:, 0] < 8.0) is None


def test_no_wait_for_one_that_stands_in_it() -> None:
    assert meeting(west(6.0), seconds=3.0) is not None
    assert meeting(west(6.0), seconds=5.0) is None
