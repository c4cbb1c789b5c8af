"""A map that has grown is not another map."""

import numpy as np

from roboglot.drivers.map_change import continues
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid

RESOLUTION = 0.05


def room(width: int, height: int, *, x: float = 0.0, shift: int = 0) -> OccupancyGrid:
    """Return a room whose left lower corner is at 0, with ``x`` the left edge of the grid, moved by cells."""
    left = round(-x / RESOLUTION) + shift
    cells = np.zeros((height + 6, left + width + 6), np.int8)
    cells[0:height, left : left + width] = 100
    cells[1 : height - 1, left + 1 : left + width - 1] = -100
    return OccupancyGrid(cells, RESOLUTION, Point(x, 0.0))


def test_a_map_that_grows_is_the_same() -> None:
    before = room(40, 30)
    grown = room(40, 30, x=-2.0)
    grown.log_odds[:10, :20] = -50  # a corridor that was unknown
    assert continues(before, grown)
    assert continues(grown, before)
    assert continues(before, room(40, 30, x=-1.0, shift=1))  # drawn better


def test_another_map_is_another() -> None:
    before = room(40, 30)
    assert not continues(before, room(70, 55, shift=3))
    assert not continues(before, room(40, 30, x=9.0, shift=180))  # elsewhere
    assert not continues(OccupancyGrid(np.zeros((0, 0), np.int8), RESOLUTION, Point()), before)
    assert not continues(before, OccupancyGrid(np.zeros((0, 0), np.int8), RESOLUTION, Point()))
