"""Evidence from rays, and matching against it, in a rectangular room made of arithmetic."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.kernels.matching import match, surface_near
from roboglot.kernels.obstacles import free_way, remember
from roboglot.kernels.occupancy import integrate
from roboglot.kernels.placing import correlate, likelihood_field
from roboglot.kernels.search import inflated_cost, nearest_open

RESOLUTION = 0.05
ROOM = (1.013, 1.021, 7.032, 5.017)  # walls at x0, y0, x1, y1, beside the cells' borders
ANGLES = np.arange(360) * math.tau / 360


def ranges_in_room(pose: tuple[float, float, float], noise: float, rng: np.random.Generator) -> np.ndarray:
    x, y, yaw = pose
    cos, sin = np.cos(ANGLES + yaw), np.sin(ANGLES + yaw)
    with np.errstate(divide="ignore"):
        away_x = np.where(cos > 0, (ROOM[2] - x) / cos, (ROOM[0] - x) / cos)
        away_y = np.where(sin > 0, (ROOM[3] - y) / sin, (ROOM[1] - y) / sin)
    return np.minimum(np.abs(away_x), np.abs(away_y)) + rng.normal(0, noise, 360)


def points_of(ranges: np.ndarray) -> np.ndarray:
    return np.stack([ranges * np.cos(ANGLES), ranges * np.sin(ANGLES)], axis=1)


def at(pose: tuple[float, float, float], points: np.ndarray) -> np.ndarray:
    x, y, yaw = pose
    c, s = math.cos(yaw), math.sin(yaw)
    return np.stack([x + c * points[:, 0] - s * points[:, 1], y + s * points[:, 0] + c * points[:, 1]], axis=1)


class Room:
    def __init__(self, noise: float = 0.01) -> None:
        self.evidence = np.zeros((120, 160), np.int16)
        self.slots = np.zeros((120, 160), np.int32)
        self.surfaces, self.used = np.zeros((120 * 160, 5), np.float32), 1
        self.marks = np.zeros((120, 160), np.int16)
        rng = np.random.default_rng(1)
        self.scans = 0
        for x in (2.0, 3.0, 4.0, 5.0):
            self.add((x, 3.0, 0.1 * x), points_of(ranges_in_room((x, 3.0, 0.1 * x), noise, rng)))

    def add(self, pose: tuple[float, float, float], points: np.ndarray) -> None:
        self.scans += 1
        hit = np.ones(len(points), np.uint8)
        arrays, ends = (self.evidence, self.slots, self.surfaces, self.used, self.marks), at(pose, points)
        self.used = integrate(*arrays, self.scans, ends, hit, *pose[:2], True, RESOLUTION)


def test_walls_stand_where_noisy_echoes_scatter_around() -> None:
    """Echoes before a wall lie in floor that rays have cleared; without them it would stand 5 mm behind itself."""
    room, rng = Room(noise=0.03), np.random.default_rng(2)
    for _ in range(80):
        pose = (rng.uniform(2.0, 6.0), rng.uniform(2.0, 4.0), rng.uniform(-3.0, 3.0))
        room.add(pose, points_of(ranges_in_room(pose, 0.03, rng)))
    east = [surface_near(room.slots, room.surfaces, room.evidence, ROOM[2] + off, y, 1.0, 0.0, RESOLUTION)[0]
            for y in np.arange(2.0, 4.0, 0.1) for off in (-0.03, 0.0, 0.03)]  # fmt: skip
    north = [surface_near(room.slots, room.surfaces, room.evidence, x, ROOM[3] + off, 0.0, 1.0, RESOLUTION)[1]
             for x in np.arange(2.0, 6.0, 0.1) for off in (-0.03, 0.0, 0.03)]  # fmt: skip
    assert np.mean(east) == pytest.approx(ROOM[2], abs=0.003)
    assert np.mean(north) == pytest.approx(ROOM[3], abs=0.003)


def test_rays_leave_free_floor_and_occupied_walls() -> None:
    room = Room()
    inside = room.evidence[25:95, 25:135]
    assert (inside < 0).mean() > 0.99
    assert not (inside > 0).any()
    walls = np.argwhere(room.evidence > 0) * RESOLUTION + RESOLUTION / 2
    off = np.minimum(
        np.minimum(abs(walls[:, 1] - ROOM[0]), abs(walls[:, 1] - ROOM[2])),
        np.minimum(abs(walls[:, 0] - ROOM[1]), abs(walls[:, 0] - ROOM[3])),
    )
    assert off.max() < 0.08
    assert not room.evidence[:15].any()  # behind the wall nothing is known


def test_someone_who_walks_on_leaves_no_trace() -> None:
    room = Room()
    ranges = ranges_in_room((4.0, 3.0, 0.0), 0.0, np.random.default_rng(2))
    blocked = ranges.copy()
    blocked[80:100] = 1.0
    for _ in range(3):
        room.add((4.0, 3.0, 0.0), points_of(blocked))
    for _ in range(12):
        room.add((4.0, 3.0, 0.0), points_of(ranges))
    assert not (room.evidence[25:95, 25:135] > 0).any()


def test_a_new_cupboard_is_believed_after_a_while() -> None:
    room = Room()
    for _ in range(40):
        room.add((4.0, 3.0, 0.0), points_of(ranges_in_room((4.0, 3.0, 0.0), 0.0, np.random.default_rng(2))))
    blocked = ranges_in_room((4.0, 3.0, 0.0), 0.0, np.random.default_rng(2))
    blocked[80:100] = 1.0
    for _ in range(15):
        room.add((4.0, 3.0, 0.0), points_of(blocked))
    assert room.evidence[int(4.0 / RESOLUTION), int(4.0 / RESOLUTION)] > 0


@pytest.mark.parametrize("off", [(0.03, -0.02, 0.02), (-0.08, 0.06, -0.04), (0.1, 0.1, 0.06)])
def test_matching_finds_the_pose_finer_than_the_cells(off: tuple[float, float, float]) -> None:
    room = Room()
    truth = (3.37, 2.41, 0.7)
    points = points_of(ranges_in_room(truth, 0.01, np.random.default_rng(7)))
    prior = np.array(truth) + off
    weak = np.diag([0.2**2, 0.2**2, 0.1**2])
    pose, covariance, strain, fit, known, *_ = match(
        room.slots, room.surfaces, room.evidence, points, prior, prior, weak, np.zeros(2), RESOLUTION, 10
    )
    assert math.hypot(pose[0] - truth[0], pose[1] - truth[1]) < 0.005
    assert abs(pose[2] - truth[2]) < math.radians(0.2)
    assert fit > 0.95 * known
    assert np.linalg.eigvalsh(covariance)[-1] < 0.01**2
    assert strain == pytest.approx(np.sum((pose - prior) ** 2 / np.diag(weak)))


def test_a_trusted_prior_stays_where_nothing_is_seen() -> None:
    empty, slots, surfaces = np.zeros((50, 50), np.int16), np.zeros((50, 50), np.int32), np.zeros((1, 5), np.float32)
    prior = np.array([1.0, 1.0, 0.3])
    points = np.ones((10, 2)) * 0.4
    pose, covariance, strain, fit, known, *_ = match(
        slots, surfaces, empty, points, prior, prior, np.eye(3), np.zeros(2), RESOLUTION, 10
    )
    assert pose == pytest.approx(prior)
    assert (fit, known) == (0, 0)
    assert covariance == pytest.approx(np.eye(3))
    assert strain == pytest.approx(0.0)


def test_relocation_finds_a_pose_half_a_metre_off() -> None:
    room = Room()
    truth = (3.37, 2.41, 0.7)
    points = points_of(ranges_in_room(truth, 0.01, np.random.default_rng(7)))[::4].copy()
    centre = np.array(truth) + np.array((0.4, -0.45, 0.25))
    field = likelihood_field(room.evidence)
    x, y, yaw, score = correlate(field, points, centre, RESOLUTION, 0.5, 0.4, 0.02, 0.0)
    assert math.hypot(x - truth[0], y - truth[1]) < 0.06
    assert abs(yaw - truth[2]) < 0.03
    assert score > 0.7


def test_of_equal_places_the_nearest_is_found() -> None:
    corridor = np.zeros((100, 200), np.int16)
    corridor[20] = corridor[60] = 100  # two walls along x: every place along them fits
    points = np.array([(x, y) for x in np.linspace(-0.5, 0.5, 11) for y in (-1.0, 1.0)])
    centre = np.array([5.0, 2.025, 0.0])
    found = correlate(likelihood_field(corridor), points, centre, RESOLUTION, 0.5, 0.2, 0.02, 0.1)
    assert found[:3] == pytest.approx((5.0, 2.025, 0.0))


def test_inflation_closes_what_the_hull_would_touch() -> None:
    evidence = np.full((60, 60), -100, np.int16)
    evidence[30, 30] = 100
    evidence[:, :10] = 0
    cost = inflated_cost(evidence, np.zeros((60, 60), np.float32), 0.0, RESOLUTION, 0.25, 0.6, 10.0, 3.0)
    assert np.isinf(cost[30, 30:35]).all()
    assert cost[30, 35] > cost[30, 38] > cost[30, 43] == 1.0
    assert cost[30, 0] == 4.0
    assert list(nearest_open(cost, 30.5, 32.5, 20.0)) == [30, 35]
    assert list(nearest_open(cost, 30.9, 30.4, 20.0)) == [35, 30]  # the place counts, not the cell's centre
    assert len(nearest_open(cost, 30.5, 30.5, 2.0)) == 0


def test_obstacles_are_remembered_until_a_ray_passes_through() -> None:
    seen, free = np.zeros((60, 60), np.float32), np.full((60, 60), -9, np.int16)
    near, far, noted, count = np.array([[1.0, 0.0]]), np.array([[2.0, 0.0]]), np.empty((9, 2), np.int32), 0
    pose = np.array((0.5, 0.5, 0.0, 0.0, 0.0))
    count, _ = remember(free, seen, near, np.ones(1, np.uint8), pose, 5.0, 3.0, RESOLUTION, noted, count)
    assert seen[10, 30] == 3.0
    cost = inflated_cost(free, seen, 2.0, RESOLUTION, 0.2, 0.5, 9.0, 3.0)
    assert np.isinf(cost[10, 30])
    count, _ = remember(free, seen, far, np.ones(1, np.uint8), pose, 5.0, 4.0, RESOLUTION, noted, count)
    assert seen[10, 30] == 0.0
    assert seen[10, 50] == 4.0
    free[10, 29] = 100  # a wall nearby explains the echo
    count, _ = remember(free, seen, near, np.ones(1, np.uint8), pose, 5.0, 5.0, RESOLUTION, noted, count)
    assert seen[10, 30] == 0.0


@given(st.integers(0, 2**32 - 1), st.integers(1, 60))
def test_rays_beside_noted_cells_need_not_be_followed(seed: int, most: int) -> None:
    random = np.random.default_rng(seed)
    evidence = np.where(random.random((80, 80)) < 0.05, 100, -100).astype(np.int16)
    sparing, thorough = np.zeros((80, 80), np.float32), np.zeros((80, 80), np.float32)
    noted, count = np.empty((most, 2), np.int32), 0
    for now in range(1, 6):
        pose = np.array((*random.uniform(1.0, 3.0, 2), random.uniform(-3.0, 3.0), 7.0, -3.0))
        angles, ways = np.linspace(-3.1, 3.1, 40), random.uniform(0.1, 2.5, 40)
        rays, hit = (ways * (np.cos(angles), np.sin(angles))).T.copy(), (random.random(40) < 0.3).astype(np.uint8)
        scan = evidence, sparing, rays, hit, pose, 2.0, float(now), RESOLUTION
        count, echoes = remember(*scan, noted, count)
        remember(evidence, thorough, *scan[2:], noted, -1)
        turn = pose[2] + angles[(hit > 0) & (ways <= 2.0)]
        there = ways[(hit > 0) & (ways <= 2.0)] * (np.cos(turn), np.sin(turn))
        assert echoes == pytest.approx(there.T + pose[:2] + pose[3:])
        assert (sparing == thorough).all()
        assert count == -1 or sorted(map(tuple, noted[:count])) == sorted(map(tuple, np.argwhere(sparing)))


def test_way_is_free_until_the_hull_would_touch() -> None:
    path = np.stack([np.arange(0, 3, 0.05), np.zeros(60)], axis=1)
    ahead = np.array([[2.0, 0.1]])
    assert free_way(path, ahead, 0.0, 0.0, 0.3) == pytest.approx(2.0 - math.sqrt(0.3**2 - 0.1**2), abs=0.051)
    assert free_way(path, np.array([[2.0, 0.4]]), 0.0, 0.0, 0.3) == math.inf
    assert free_way(path, np.array([[-0.2, 0.0]]), 0.0, 0.0, 0.3) == math.inf  # leaving the wall behind


def test_surfaces_that_another_thread_added_are_left_out() -> None:
    room, (x, y) = Room(), (ROOM[2], 3.0)
    none = surface_near(room.slots, room.surfaces[:1], room.evidence, x, y, 1.0, 0.0, RESOLUTION)
    assert none == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert surface_near(room.slots, room.surfaces, room.evidence, x, y, 1.0, 0.0, RESOLUTION)[4] > 0.0
