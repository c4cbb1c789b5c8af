"""Wheels against scans among things that move along, in a corridor whose walls show no way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.model.components.sensing.odometry import OdometryNoise
from roboglot.model.geometry import Point, Pose

HALF, RAYS, REACH = 0.9, 720, 6.0  # m from the middle to a wall; m that the lidar sees
ALONG = ((1.3, 0.45), (2.1, -0.45), (-1.1, -0.4), (-1.9, 0.45))  # robots driving alongside, relative to the robot
PILLARS = ((3.1, 0.55), (-2.9, -0.55), (0.9, -0.7), (-0.5, 0.7))  # in map
RADIUS, PILLAR = 0.25, 0.12  # m
TIGHT = np.diag((0.02**2, 0.02**2, 0.01**2))


def scanned(x: float, robots: tuple[tuple[float, float], ...] = ALONG) -> ScanPoints:
    """Return the scan of a robot in the middle of the corridor, ``x`` m along it; ``robots`` relative to it."""
    angles = np.arange(RAYS) * math.tau / RAYS
    c, s = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        away = np.minimum(REACH + 1.0, HALF / np.abs(s))
    things = [(px, py, RADIUS) for px, py in robots] + [(px - x, py, PILLAR) for px, py in PILLARS]
    for px, py, radius in things:
        middle, beside = c * px + s * py, c * py - s * px
        hits = (middle > 0.0) & (np.abs(beside) < radius)
        front = middle - np.sqrt(np.maximum(radius**2 - beside**2, 0.0))
        away = np.where(hits, np.minimum(away, front), away)
    ends = np.stack([c * np.minimum(away, REACH), s * np.minimum(away, REACH)], axis=1)
    hit = (away < REACH).astype(np.uint8)
    return ScanPoints(ends, hit, np.ascontiguousarray(ends[hit > 0]), Point())


@pytest.fixture(scope="module")
def painted() -> EvidenceGrid:
    """A map in which the robots that are about to drive along stand like furniture."""
    from roboglot.autonomy.slam.painting import paint

    grid = EvidenceGrid()
    for _ in range(10):
        paint(grid, scanned(0.0), Pose(), fill=True)
    return grid


@pytest.mark.parametrize("driven", [0.06, 0.1, 0.15])
def test_wheels_are_believed_where_robots_drive_along(painted: EvidenceGrid, driven: float) -> None:
    """The wheels are believed instead of a misled match, and no match that is misled as well."""
    from roboglot.autonomy.slam.contradictions import contested
    from roboglot.autonomy.slam.matcher import FREE, fit

    scan, prior = scanned(driven), np.diag((0.02**2, 0.02**2, 0.01**2))
    best = fit(painted, scan, Pose(driven), FREE)
    assert abs(best.pose.x - driven) > 0.04  # otherwise the test proves nothing
    found = contested(painted, scan, Pose(driven, 0.01), best, prior, 0.5, 0.01)
    assert found is not None
    assert found.pose.distance_to(Pose(driven)) < 0.01  # the walls show the distance from the middle


def test_wheels_that_slip_are_not_believed_alone(painted: EvidenceGrid) -> None:
    from roboglot.autonomy.slam.contradictions import contested
    from roboglot.autonomy.slam.matcher import FREE, fit

    scan, prior = scanned(0.0), np.diag((0.02**2, 0.02**2, 0.01**2))
    best = fit(painted, scan, Pose(0.02), FREE)
    assert contested(painted, scan, Pose(0.1), best, prior, 0.5, 0.01) is None


LEFT = 0.18  # m that the robot ahead drove on


def seen(driven: float, far: float = 2.0, step: float = 0.03) -> ScanPoints:
    """Walls as ``far`` as it sees, two points of a pillar, and eight of a robot ahead that has ``driven`` on.

    More with a smaller ``step`` (m) between them.
    """
    walls = np.concatenate([line((-far, y), (far, y)) for y in (-HALF, HALF)])
    robot, pillar = line((1.3, 0.2), (1.3, 0.44), step), line((-1.5, 0.1), (-1.5, 0.16))
    points = np.concatenate([walls, robot + np.array((driven, 0.0)), pillar])
    return ScanPoints(points, np.ones(len(points), np.uint8), points, Point())


@pytest.fixture(scope="module")
def left() -> EvidenceGrid:
    """A map in which the robot ahead still stands where it stood."""
    from roboglot.autonomy.slam.painting import paint

    grid = EvidenceGrid()
    for _ in range(10):
        paint(grid, seen(0.0, REACH), Pose(), fill=False)
    return grid


@pytest.mark.parametrize(("far", "step"), [(2.0, 0.03), (1.5, 0.0095)], ids=["few to few", "few to many"])
def test_robot_that_leaves_moves_none_that_stands(left: EvidenceGrid, far: float, step: float) -> None:
    """Few points tell, but no noise makes those on the pillar prefer the wrong place."""
    from roboglot.autonomy.slam.contradictions import contested
    from roboglot.autonomy.slam.matcher import FREE, fit

    scan = seen(LEFT, far, step)
    misled = fit(left, scan, Pose(-LEFT), FREE, iterations=0)
    found = contested(left, scan, Pose(), misled, TIGHT, 0.0, 0.004)
    assert found is not None
    assert found.pose.distance_to(Pose()) < 0.01


@pytest.mark.parametrize(("scans", "believes_wheels"), [(6, True), (10, False)], ids=["just seen", "known well"])
def test_new_objects_do_not_overrule_the_wheels(scans: int, believes_wheels: bool) -> None:
    """Six scans hardly outweigh ten that saw free floor there. A thing known well shows that the wheels slip."""
    from roboglot.autonomy.slam.contradictions import contested
    from roboglot.autonomy.slam.matcher import FREE, fit
    from roboglot.autonomy.slam.painting import paint

    grid, walls = EvidenceGrid(), np.concatenate([line((-REACH, y), (REACH, y)) for y in (-HALF, HALF)])
    for _ in range(10):
        paint(grid, ScanPoints(walls, np.ones(len(walls), np.uint8), walls, Point()), Pose(), fill=False)
    for _ in range(scans):
        paint(grid, seen(0.0, REACH), Pose(), fill=False)
    scan = seen(LEFT)
    misled = fit(grid, scan, Pose(-LEFT), FREE, iterations=0)
    found = contested(grid, scan, Pose(), misled, TIGHT, 0.5, 0.01)
    assert (found is not None) is believes_wheels


def test_new_neighbours_move_none_that_stands() -> None:
    """It has just come among others, which then drive on together; no wall shows its place in the corridor."""
    from roboglot.autonomy.slam.contradictions import contested
    from roboglot.autonomy.slam.matcher import FREE, fit
    from roboglot.autonomy.slam.painting import paint

    grid, here = EvidenceGrid(), 20.0  # no pillar is in sight
    for _ in range(3):
        paint(grid, scanned(here), Pose(here), fill=True)
    scan = scanned(here, tuple((x + LEFT, y) for x, y in ALONG))
    misled = fit(grid, scan, Pose(here - LEFT), FREE)
    assert misled.pose.distance_to(Pose(here - LEFT)) < 0.02  # otherwise the test proves nothing
    found = contested(grid, scan, Pose(here), misled, TIGHT, 0.0, 0.004)
    assert found is not None
    assert found.pose.distance_to(Pose(here)) < 0.01


def test_past_that_was_overruled_does_not_testify(left: EvidenceGrid) -> None:
    """A standing robot that was misled for a moment returns to its place, and stays there."""
    from roboglot.autonomy.slam.contradictions import WheelWitness
    from roboglot.autonomy.slam.matcher import FREE, fit
    from roboglot.autonomy.slam.odometry.learner import OdometryLearner

    witness, scan, pose = WheelWitness(OdometryLearner(OdometryNoise())), seen(LEFT), Pose()
    for number in range(20):
        if number == 5:
            pose = Pose(-LEFT)
        best = fit(left, scan, pose, FREE, iterations=0)
        driven = witness.contest(left, scan, pose, best, TIGHT, Pose()) if number > 5 else None
        pose = driven.pose if driven is not None else pose
        witness.note(0.5 * number, pose, 0.0)
        if number > 6:
            assert pose.distance_to(Pose()) < 0.01, number


def line(start: tuple[float, float], end: tuple[float, float], step: float = 0.03) -> NDArray[np.float64]:
    count = math.ceil(math.dist(start, end) / step)
    return np.linspace(start, end, count, endpoint=False)


def test_walls_are_straight_and_wider_than_robots() -> None:
    from roboglot.autonomy.slam.walls import on_walls

    noise = np.random.default_rng(1).normal(0.0, 0.01, (1000, 2))
    corner = np.concatenate([line((-2.0, 1.5), (1.0, 1.5)), line((1.0, 1.5), (1.0, -1.0))])
    bend = np.linspace(-1.6, 1.6, 60)
    row = [np.stack([3.0 - 0.3 * np.cos(bend), y + 0.3 * np.sin(bend)], axis=1) for y in (-2.0, -1.4, -0.8)]
    board = line((-1.0, -3.0), (-0.3, -3.0))
    for points, expected in ((corner, True), (np.concatenate(row), False), (board, False)):
        found = on_walls(points + noise[: len(points)])
        assert found.mean() > 0.95 if expected else not found.any()
    assert not on_walls(np.empty((0, 2))).any()
