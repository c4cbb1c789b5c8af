"""Rooms of a floor plan and what can be seen of them."""

from __future__ import annotations

import math

import numpy as np

from roboglot.kernels.raster import ROOMS_MAX, label, look


def plan(*rows):
    return np.array([[cell == "#" for cell in row] for row in rows], dtype=np.uint8)


TWO_ROOMS = ["###########", "#    #    #", "#    #    #", "#    #    #", "###########"]


def test_rooms_are_numbered_and_walls_belong_to_neighbour():
    rooms = np.zeros((5, 11), np.uint8)
    assert label(plan(*TWO_ROOMS), rooms) == 2
    assert set(rooms[1:4, 1:5].ravel()) == {1}
    assert set(rooms[1:4, 6:10].ravel()) == {2}
    assert rooms.min() == 1
    assert rooms[2, 0] == 1
    assert rooms[2, 10] == 2


def test_more_rooms_than_numbers_share_the_last_one():
    cells = np.ones((3, 2 * ROOMS_MAX + 41), np.uint8)
    cells[1, 1::2] = 0
    rooms = np.zeros(cells.shape, np.uint8)
    assert label(cells, rooms) == ROOMS_MAX
    assert rooms[1, -2] == ROOMS_MAX


def seen_from(x, y, yaw, spread, door):
    closed = plan(*TWO_ROOMS).repeat(10, 0).repeat(10, 1)
    rooms = np.zeros(closed.shape, np.uint8)
    label(closed, rooms)
    solid = closed.copy()
    if door:
        solid[20:30, 50:60] = 0
    visible = np.zeros(ROOMS_MAX + 1, np.uint8)
    look(solid, rooms, x, y, yaw, spread, visible)
    return set(np.nonzero(visible)[0])


def test_wall_hides_next_room_and_door_shows_it():
    assert seen_from(20, 25, 0.0, 1.2, door=False) == {1}
    assert seen_from(20, 25, 0.0, 1.2, door=True) == {1, 2}


def test_rooms_behind_are_not_seen():
    assert seen_from(20, 25, math.pi, 1.2, door=True) == {1}
    assert seen_from(20, 25, math.pi, math.tau, door=True) == {1, 2}
