"""Laser landmarks: found by the lidar's reflections, kept with the map, used by a robot that was carried off."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roboglot.autonomy.landmarks.finder import pose_by_landmarks
from roboglot.autonomy.landmarks.pose_update import pose_fixed
from roboglot.autonomy.slam.belief import SURE
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.laser_landmarks import LaserLandmarks
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.model.maps import PointOfInterest

STRIPS_WORLD = str(Path(__file__).with_name("worlds") / "strips.toml")
PASSAGE = str(Path(__file__).with_name("worlds") / "passage.toml")
BARE = [(24.0, 0.0), (29.0, 2.4), (35.0, 0.0)]
STRIPS = [(0.0, 5.0), (0.0, 6.1), (8.0, 6.6), (3.2, 8.0)]


@pytest.mark.world(STRIPS_WORLD)
async def test_strips_become_landmarks(tour):
    await tour.go((4.0, 4.6), deg=90)
    await tour.clock.advance(3.0)
    marks = tour.robot[MapAnnotations].current.landmarks
    found = [tour.start.compose(mark.pose) for mark in marks]
    assert len(found) == 4
    for strip in STRIPS:
        assert min(place.distance_to(Pose(*strip)) for place in found) < 0.06
    assert len({mark.id for mark in marks}) == 4


@pytest.mark.world(STRIPS_WORLD)
async def test_switched_off_nothing_is_added(tour):
    await tour.robot[LaserLandmarks].set_updating(False)
    await tour.go((4.0, 4.6), deg=90)
    assert tour.robot[MapAnnotations].current.landmarks == ()


def test_the_only_pose_that_fits():
    known = [Point(0, 0), Point(4, 0), Point(4, 3), Point(9, 9)]
    truth = Pose(2.0, 1.0, 2.0)
    seen = [Pose(p.x, p.y).relative_to(truth).point for p in known[:3]]
    found = pose_by_landmarks(seen, known)
    assert found.distance_to(truth) < 1e-6
    assert abs(wrap_angle(found.yaw - truth.yaw)) < 1e-6
    assert pose_by_landmarks(seen[:2], known) is None
    square = [Point(0, 0), Point(4, 0), Point(4, 4), Point(0, 4)]
    assert pose_by_landmarks(square, square) is None  # four ways to see it


@pytest.mark.slow  # in short: test_the_only_pose_that_fits
@pytest.mark.world(STRIPS_WORLD)
async def test_a_lost_robot_finds_itself_by_them(tour):
    await tour.go((4.0, 4.6), deg=90)
    await tour.clock.advance(3.0)
    tour.robot[Localization].set_pose(Pose(-5.0, -5.0, math.pi / 3))
    await tour.until(lambda: tour.error[0] < 0.15, 20)
    await tour.clock.advance(2.0)
    assert tour.error[0] < 0.05
    assert tour.error[1] < 1.0


def seen_from(pose, *marks):
    return [Pose(mark.x, mark.y).relative_to(pose).point for mark in marks]


def test_a_pose_moves_only_where_it_is_unsure():
    mark, truth, believed = Point(3.0, 1.0), Pose(0.4, 0.0), Pose(0.0, 0.1)
    along = np.diag((0.5**2, 0.003**2, 0.002**2))  # as in a corridor along x
    fixed, covariance = pose_fixed(believed, along, seen_from(truth, mark), [mark, Point(9.0, 9.0)])
    assert abs(fixed.x - 0.4) < 0.02
    assert abs(fixed.y - 0.1) < 0.01
    assert covariance[0, 0] < 0.05**2
    sure, same = pose_fixed(believed, np.diag(SURE), seen_from(truth, mark), [mark])
    assert sure == believed  # too far away to be that landmark
    assert (same == np.diag(SURE)).all()
    twins = [mark, Point(3.3, 1.0)]
    assert pose_fixed(believed, along, seen_from(truth, mark), twins)[0] == believed


@pytest.mark.slow  # the arithmetic: test_a_pose_moves_only_where_it_is_unsure
@pytest.mark.world(PASSAGE)
async def test_landmarks_fix_the_place_along_a_passage(tour):
    await tour.robot[LaserLandmarks].set_updating(False)
    marks = [PointOfInterest(str(n), Pose(p.x, p.y)) for n, p in enumerate(map(tour.on_map, *zip(*BARE, strict=True)))]
    await tour.robot[MapAnnotations].change(lambda now: replace(now, landmarks=tuple(marks)))
    drive = tour.head_for((36.0, 1.2), tolerance=0.3)
    await tour.until(lambda: tour.truth.x > 18.0)
    tour.world.stage.place("a", tour.truth.compose(Pose(0.2)))  # neither walls nor wheels determine it
    await tour.clock.advance(2.0)
    assert tour.error[0] > 0.15
    await tour.end_of(drive)
    assert tour.error[0] < 0.06
