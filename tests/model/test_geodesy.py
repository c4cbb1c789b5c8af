"""A map's place on the globe: found from fixes, and what a fix says of a place in it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.components.sensing.gps import GpsFix, GpsReading
from roboglot.model.geodesy import GlobeAnchor, anchor, metres_a_degree, offset
from roboglot.model.geometry import Point

HOME = (52.5, 13.4)
angles = st.floats(-math.pi, math.pi)


def fix_at(east: float, north: float, accuracy: float = 1.0) -> GpsReading:
    across, meridian = metres_a_degree(HOME[0])
    return GpsReading(0.0, GpsFix.SPACE, 12, HOME[0] + north / meridian, HOME[1] + east / across, 0.0, accuracy)


def seen(point: Point, north_is: float) -> GpsReading:
    """Return the fix at a point of a map whose origin is at home and whose north is there."""
    c, s = math.cos(north_is), math.sin(north_is)
    return fix_at(east=point.x * s - point.y * c, north=point.x * c + point.y * s)


def test_a_degree_is_what_the_ellipsoid_says() -> None:
    across, meridian = metres_a_degree(45.0)
    assert meridian == pytest.approx(111_131.8, abs=1.0)
    assert across == pytest.approx(78_846.8, abs=1.0)
    east, north = offset(0.0, 179.9999, 0.0, -179.9999)  # across the date line
    assert (east, north) == (pytest.approx(22.26, abs=0.01), 0.0)


@given(angles, st.floats(-80, 80), st.floats(-80, 80))
def test_north_is_found_on_the_way(north_is: float, x: float, y: float) -> None:
    way = [Point(0.0, 0.0), Point(10.0, 0.0), Point(10.0, 8.0), Point(2.0, 9.0)]
    found = anchor((point, seen(point, north_is)) for point in way)
    assert found
    assert found.north is not None
    assert math.remainder(found.north - north_is, math.tau) == pytest.approx(0.0, abs=1e-3)
    place = Point(x, y)
    region = found.around(seen(place, north_is))
    assert (region.min_x + region.max_x) / 2 == pytest.approx(x, abs=0.1)
    assert (region.min_y + region.max_y) / 2 == pytest.approx(y, abs=0.1)
    assert found.allows(seen(place, north_is), place)
    assert not found.allows(seen(place, north_is), Point(x + 30.0, y))


@given(angles)
def test_robot_that_stood_still_knows_the_distance_alone(north_is: float) -> None:
    found = anchor([(Point(), seen(Point(), north_is))] * 5)
    assert found
    assert found.north is None
    there = Point(50.0, 0.0)
    assert found.allows(seen(there, north_is), there)
    assert found.allows(seen(there, north_is), Point(0.0, -50.0))
    assert not found.allows(seen(there, north_is), Point())


def test_without_a_fix_there_is_no_place() -> None:
    assert anchor([]) is None
    assert anchor([(Point(), GpsReading(0.0))]) is None
    assert GlobeAnchor(Point(), *HOME, 1.0).allows(fix_at(0.0, 0.0), Point())
