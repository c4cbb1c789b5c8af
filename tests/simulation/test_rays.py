"""Compiled rays against MuJoCo's own as the judge: every shape, from outside and from within; and what they replace."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.kernels.rays import cast
from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

RAYS = 60
KINDS = [mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER]
KINDS.append(mujoco.mjtGeom.mjGEOM_BOX)


def directions(random: np.random.Generator) -> np.ndarray:
    ways = np.concatenate((random.standard_normal((RAYS - 6, 3)), np.eye(3), -np.eye(3)))
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def bundle(random: np.random.Generator) -> np.ndarray:
    ways = random.standard_normal(3) + random.uniform(0.05, 0.6) * random.standard_normal((RAYS, 3))
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


@given(st.integers(0, 2**32 - 1), st.floats(0.3, 9.0))
def test_every_shape_is_met_as_by_mujoco(seed: int, reach: float) -> None:
    random = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    for number in range(24):
        attitude = random.standard_normal(4) if number % 3 else (1.0, 0.0, 0.0, 0.0)
        body = spec.worldbody.add_body(pos=random.uniform(-3, 3, 3), quat=attitude)
        body.add_geom(type=KINDS[number % 4], size=random.uniform(0.1, 1.2, 3))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    origins, ways = random.uniform(-3, 3, (2, 3)), np.concatenate((directions(random), bundle(random)))
    found, expected = np.empty((2, RAYS), np.int32), np.empty((2, RAYS))
    groups = np.ones(6, np.uint8)
    for number, there in enumerate(np.split(ways, 2)):
        asked = origins[number], there.ravel(), groups, True, -1, found[number], expected[number], None, RAYS, 1e6
        mujoco.mj_multiRay(model, data, *asked)
    expected[(found < 0) | (expected > reach)] = np.inf
    solids = data.geom_xpos, data.geom_xmat, model.geom_size, model.geom_rbound
    assert cast(model.geom_type, *solids, origins, ways, reach) == pytest.approx(expected.ravel(), abs=1e-9)


@pytest.mark.parametrize(
    ("name", "is_compiled"), [("office", True), ("obstacle_course", False)]
)  # only MuJoCo models ramps
async def test_sensors_see_the_same_with_the_kernel(name: str, is_compiled: bool) -> None:
    clock = LockstepClock()
    robots = [RobotPlacement("a"), RobotPlacement("b")]
    world = World(load_world(name), robots, clock=clock)
    world.start()
    await clock.advance(0.1)  # otherwise the physics does not know yet where things are
    hull, rays, ways = world._population.hull("a"), world._physics.rays, directions(np.random.default_rng(1))
    origin = np.array(((hull.x, hull.y, hull.elevation + 0.2),))
    eyes, noise = np.array(((0.1, 0.0, 0.2), (0.0, -0.1, 0.3))), np.random.default_rng(2).standard_normal(len(ways))
    shares = np.linspace(0.5, 1.0, len(ways))
    hull.tilt = 0.1, -0.2
    before, looked = rays.cast(origin, ways, 4.0, hull), rays.look(eyes, ways, 4.0, hull)
    measured = rays.reading(looked, shares, noise, (0.01, 0.02), (0.3, 3.0, -np.inf))
    rays.load_kernel()
    assert (rays._kernel is not None) is is_compiled
    assert rays.cast(origin, ways, 4.0, hull) == pytest.approx(before, abs=1e-9)
    assert rays.look(eyes, ways, 4.0, hull) == pytest.approx(looked, abs=1e-9)
    again = rays.reading(looked, shares, noise, (0.01, 0.02), (0.3, 3.0, -np.inf))
    assert again == pytest.approx(measured, abs=1e-6)
    assert {-np.inf, np.inf} < set(measured.tolist())
    assert np.isfinite(before).any()
    assert before.min() > 0.19  # the floor: it does not see itself
    world.close()
