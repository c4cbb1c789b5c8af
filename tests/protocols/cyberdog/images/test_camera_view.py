"""Conversion from a region of the picture to a place before the robot, and back."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.components.sensing.camera import Mount
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Box
from roboglot.model.sensing import LaserScan
from roboglot.protocols.cyberdog.chapters.camera.projection import CameraView


class Camera:
    """1280 x 720, 70 degrees, in front and pointing up a little, as the dog's."""

    width, height, fov = 1280, 720, math.radians(70.0)
    mount = Mount(0.25, 0.0, 0.34, pitch=-0.1)


def view() -> CameraView:
    camera: Any = Camera()
    return CameraView(camera)


def scan_of(place: Point) -> LaserScan:
    """Return a scan with one echo, at ``place`` (base_link), and nothing else."""
    angles = np.linspace(-math.pi, math.pi, 360, endpoint=False)
    ranges = np.full(360, np.inf, np.float32)
    bearing = math.atan2(place.y, place.x)
    ranges[int(np.argmin(np.abs(angles - bearing)))] = math.hypot(place.x, place.y)
    step = float(angles[1] - angles[0])
    return LaserScan(0.0, ranges, -math.pi, step, 0.1, 12.0, Pose())


@given(st.floats(1.0, 6.0), st.floats(-0.4, 0.4), st.floats(0.05, 0.3), st.floats(0.1, 0.5))
def test_a_thing_appears_again_where_it_was_chosen(away: float, slope: float, width: float, height: float) -> None:
    place = Point(0.25 + away, slope * away)
    sight = view()
    middle = sight.box(sight.extent(Box(0.5, 0.5, width, height), place), place)
    box = Box(middle.x, 0.5, width, height)
    again = sight.box(sight.extent(box, place), place)
    assert (again.x, again.y) == (pytest.approx(box.x, abs=0.02), pytest.approx(0.5, abs=0.03))
    assert (again.width, again.height) == (pytest.approx(width, rel=0.1), pytest.approx(height, rel=0.1))


@given(st.floats(1.0, 6.0), st.floats(-0.4, 0.4))
def test_only_the_region_s_return_is_found(away: float, slope: float) -> None:
    place, sight = Point(0.25 + away, slope * away), view()
    scan = scan_of(place)
    at = sight.box(sight.extent(Box(0.5, 0.5, 0.2, 0.4), place), place)
    found = sight.nearest(Box(at.x, 0.5, 0.2, 0.4), scan)
    assert found
    assert found.distance_to(place) < 0.1
    beside = 0.3 if at.x < 0.5 else -0.3
    assert sight.nearest(Box(at.x + beside, 0.5, 0.2, 0.4), scan) is None


def test_nearer_is_larger_and_behind_is_nowhere() -> None:
    sight = view()
    extent = sight.extent(Box(0.5, 0.5, 0.1, 0.3), Point(4.0, 0.0))
    assert sight.box(extent, Point(2.0, 0.0)).width > 0.18
    assert sight.box(extent, Point(-1.0, 0.0)) == Box(0.0, 0.0, 0.0, 0.0)
