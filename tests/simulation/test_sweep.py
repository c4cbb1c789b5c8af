"""Rays against edges and circles: analytic cases, and MuJoCo's own rays as the judge."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.kernels.sweep import blur as compiled_blur
from roboglot.kernels.sweep import sweep as compiled
from roboglot.model.geometry import Pose
from roboglot.simulation.world.sweep import (
    NOTHING,
    blur,
    directions,
    sweep,
)

SQUARE = np.array([(0, 10), (10, 10 + 10j), (10 + 10j, 10j), (10j, 0)], dtype=complex)[:, ::-1]  # a room, seen inside


def test_nothing_to_see():
    assert np.isinf(sweep(NOTHING, NOTHING, 0.0, 0.0, 0.0, 360, 12.0)).all()


@given(st.floats(0.5, 9.5), st.floats(0.5, 9.5), st.floats(-7, 7), st.integers(4, 720))
def test_in_a_square_room(x, y, yaw, rays):
    ranges = sweep(SQUARE, NOTHING, x, y, yaw, rays, 20.0)
    for i, distance in enumerate(ranges):
        angle = yaw - math.pi + i * math.tau / rays
        c, s = math.cos(angle), math.sin(angle)
        across = (10 - x) / c if c > 0 else -x / c if c < 0 else math.inf
        along = (10 - y) / s if s > 0 else -y / s if s < 0 else math.inf
        assert distance == pytest.approx(min(across, along), rel=1e-6)


@given(st.floats(-7, 7), st.floats(0.05, 1.0), st.floats(1.5, 8.0))
def test_a_circle_ahead(direction, radius, away):
    circle = np.array([(away * complex(math.cos(direction), math.sin(direction)), radius)])
    ranges = sweep(NOTHING, circle, 0.0, 0.0, direction, 360, 12.0)
    assert ranges[180] == pytest.approx(away - radius)
    half = math.asin(radius / away) / math.radians(1)
    assert np.isfinite(ranges).sum() == pytest.approx(2 * half, abs=1.01)


def test_beyond_reach_is_nothing():
    assert np.isinf(sweep(SQUARE, NOTHING, 5.0, 5.0, 0.0, 360, 4.9)).all()


@pytest.mark.parametrize("name", ["office", pytest.param("tests/data/maps/depot.yaml", marks=pytest.mark.slow)])
async def test_agrees_with_mujoco(simulate, request, name):
    path = str(request.config.rootpath / name) if "/" in name else name
    sim = simulate(path, robots=("a", "b"))
    physics, hull = sim.world._physics, sim.world._physics.hulls["a"]
    sim.world.stage.add_obstacle(Pose(10, 10, 0.3), (1.0, 0.5, 0.6))
    chance, compared = np.random.default_rng(1), 0
    directions, hits, ids = np.zeros((360, 3)), np.empty(360), np.empty(360, np.int32)
    for _ in range(80):
        pose = Pose(chance.uniform(1, 29), chance.uniform(1, 14), chance.uniform(-3, 3))
        floor = int(chance.integers(0, len(sim.world.description.floors)))
        if sim.world.truth.in_the_way("a", pose, floor):
            continue
        sim.world.stage.place("a", pose, floor)
        height = float(chance.uniform(0.1, 0.9))
        ranges = sim.world._environment.sight.turn(hull, height, 360, 12.0)
        mujoco.mj_forward(physics._model, physics._data)
        angles = pose.yaw - math.pi + np.arange(360) * math.tau / 360
        directions[:, 0], directions[:, 1] = np.cos(angles), np.sin(angles)
        origin = np.array((pose.x, pose.y, hull.elevation + height))
        # its own two cylinders are ignored: one is excluded, the other is below or around the sensor
        own = [physics._model.geom(f"a {part}").id for part in ("chassis", "torso")]
        physics._model.geom_group[own] = 1
        groups = np.array([1, 0, 0, 0, 0, 0], np.uint8)
        mujoco.mj_multiRay(
            physics._model, physics._data, origin, directions.ravel(), groups, 1, -1, ids, hits, None, 360, 12.0
        )
        judge = np.where((hits < 0) | (hits > 12.0), np.inf, hits)
        if judge.min() < 0.3:
            continue  # inside a solid, where no robot can be
        compared += 1
        assert np.allclose(ranges, judge, atol=1e-6), pose
    assert compared > 30


def test_the_compiled_kernel_sees_the_same():
    chance = np.random.default_rng(3)
    points = chance.uniform(-8, 8, (60, 2)) @ (1, 1j)
    edges = np.stack((points, points + chance.uniform(-2, 2, (60, 2)) @ (1, 1j)), axis=1)
    circles = np.stack((chance.uniform(-8, 8, (30, 2)) @ (1, 1j), chance.uniform(0.1, 1.0, 30) + 0j), axis=1)
    for rays in (4, 360, 1600):
        ways = directions(rays).view(float).reshape(-1, 2)
        for _ in range(20):
            x, y, yaw = chance.uniform(-5, 5, 3)
            seen = compiled(edges.view(float), circles.view(float), ways, x, y, yaw, 9.0)
            assert np.allclose(seen, sweep(edges, circles, x, y, yaw, rays, 9.0), atol=1e-9)


@pytest.mark.parametrize("make", [blur, compiled_blur])
def test_noise_and_the_ends_of_the_range(make):
    exact = np.array([5.0, 5.0, 0.1, 0.149, 0.151, 11.99, 12.01, np.inf, 3.0])
    noise = np.array([0.0, -2.0, 0.0, 1.0, -1.0, 1.0, -2.0, 0.0, 100.0], np.float32)
    reported = make(exact, noise, 0.01, 0.15, 12.0)
    assert reported.dtype == np.float32
    seen = np.array([5.0, 4.98, np.nan, 0.159, np.nan, 12.0, 11.99, np.inf, 4.0])
    assert np.allclose(reported, seen, atol=1e-6, equal_nan=True)


def test_compiled_noise_is_the_same_to_the_bit():
    chance = np.random.default_rng(4)
    exact, noise = chance.uniform(0.0, 14.0, 5000), chance.standard_normal(5000, dtype=np.float32)
    exact[chance.integers(0, 5000, 400)] = np.inf
    plain, quick = (make(exact, noise, 0.013, 0.2, 11.0) for make in (blur, compiled_blur))
    assert np.array_equal(plain, quick, equal_nan=True)


def test_hidden_and_overlapping_crowds_are_swept_alike() -> None:
    """The compiled kernel leaves circles out that something hides; plain numpy looks at all of them."""
    random = np.random.default_rng(5)
    for _ in range(300):
        count, rays = int(random.integers(1, 120)), int(random.choice([120, 360, 1600]))
        places, radii = random.uniform(-10.0, 10.0, (count, 2)), random.uniform(0.03, 0.6, count)
        circles = np.column_stack((places, radii, np.zeros(count)))
        ends = random.uniform(-8.0, 8.0, (int(random.integers(0, 12)), 4))
        x, y, yaw = random.uniform(-1.0, 1.0, 3).tolist()
        ways = directions(rays).view(np.float64).reshape(rays, 2)
        quick = compiled(ends, circles, ways, x, y, 9.0 * yaw, 12.0)
        plain = sweep(ends.view(np.complex128), circles.view(np.complex128), x, y, 9.0 * yaw, rays, 12.0)
        assert np.allclose(quick, plain, atol=1e-9)
