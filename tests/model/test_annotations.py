"""Geometry of lines and areas on the map."""

import itertools
import math

import pytest

from roboglot.model.components.mapping.annotations import (
    Annotations,
    Area,
    AreaKind,
    Line,
    LineKind,
)
from roboglot.model.geometry import Point


def test_a_straight_line_is_its_ends() -> None:
    line = Line(1, LineKind.WALL, Point(0, 0), Point(3, 4))
    assert line.points() == (Point(0, 0), Point(3, 4))


def test_curve_goes_from_end_to_end_as_bezier() -> None:
    line = Line(1, LineKind.TRACK, Point(0, 0), Point(3, 0), control=(Point(0, 3), Point(3, 3)))
    points = line.points()
    assert (points[0], points[-1]) == (Point(0, 0), Point(3, 0))
    middle = points[len(points) // 2]
    assert (middle.x, middle.y) == pytest.approx((1.5, 2.25), abs=0.1)
    assert max(a.distance_to(b) for a, b in itertools.pairwise(points)) < 0.15


def test_area_is_a_rectangle_around_its_centre_line() -> None:
    half = math.sqrt(0.5)
    area = Area(1, AreaKind.FORBIDDEN, Point(0, 0), Point(2, 2), half_width=half)
    assert area.contains(Point(1, 1))
    assert area.contains(Point(1.4, 0.6))
    assert not area.contains(Point(1.6, 0.4))
    assert not area.contains(Point(-0.1, -0.1))
    corners = [(round(p.x, 6), round(p.y, 6)) for p in area.corners()]
    assert corners == [(0.5, -0.5), (2.5, 1.5), (1.5, 2.5), (-0.5, 0.5)]


def test_ids_are_never_given_twice() -> None:
    wall = Line(0, LineKind.WALL, Point(), Point(1, 0))
    area = Area(99, AreaKind.DANGEROUS, Point(), Point(1, 0), 1.0)
    first = Annotations().with_new(wall, area)
    assert ([line.id for line in first.lines], [a.id for a in first.areas]) == ([1], [2])
    emptied = Annotations(last_id=first.last_id)
    assert [line.id for line in emptied.with_new(wall).lines] == [3]
