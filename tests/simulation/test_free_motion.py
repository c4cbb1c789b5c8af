"""Robots that nothing can touch move without MuJoCo's steps, as those would move them."""

from __future__ import annotations

import contextlib
import copy
import math
import random

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from roboglot.kernels.layouts import HULL_LOOKUP_X, HULL_LOOKUP_Y, HULL_WALLS
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs
from roboglot.model.errors import Collided, Refused
from roboglot.model.geometry import Pose, Twist, Vector3
from roboglot.model.robot import Robot
from roboglot.simulation.world.contact_switch import NO_CONTACTS
from roboglot.simulation.world.description import Box
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

from .conftest import Simulate, Simulation

BODIES = ("universal", "cyberdog2", "hermes", "robomaster_ep")
STEPS = 3


async def settled(simulation: Simulation) -> None:
    simulation.world.start()
    await simulation.clock.advance(0.5)


async def test_gliding_equals_the_physics_of_mujoco() -> None:
    """Hard commands, servos at their limits, torsos that sink and rise."""
    clock, dice = LockstepClock(), random.Random(1)
    world = World(load_world("office"), [RobotPlacement(body, body) for body in BODIES], clock=clock)
    for body in BODIES:
        world.equip(Robot(body, world.description_of(body), clock))
    physics = world._physics
    physics.load_kernels()
    world.start()
    await clock.advance(0.5)
    free_motion, data, model = physics._free_motion, physics._data, copy.copy(physics._model)
    assert free_motion is not None
    model.opt.disableflags |= NO_CONTACTS
    glided = 0
    for tick in range(200):
        for hull in physics.hulls.values():
            if tick % 7 == 0:
                data.ctrl[hull._drive] = dice.uniform(-2, 2), dice.uniform(-2, 2), dice.uniform(-6, 6)
            if hull.legs and tick % 20 == 0:
                hull.legs.hold(dice.choice((None, dice.uniform(0.1, 0.25))))
                model.actuator_gainprm[:], model.actuator_biasprm[:] = (
                    physics._model.actuator_gainprm,
                    physics._model.actuator_biasprm,
                )
        expected = copy.copy(data)
        mujoco.mj_step(model, expected, nstep=STEPS)
        if free_motion.step(STEPS):
            glided += 1
        else:  # a torso at its stops
            mujoco.mj_step(model, data, nstep=STEPS)
        assert np.allclose(data.qpos, expected.qpos, rtol=0.0, atol=1e-12)
        assert np.allclose(data.qvel, expected.qvel, rtol=0.0, atol=1e-12)
        assert np.allclose(data.actuator_force, expected.actuator_force, rtol=0.0, atol=1e-9)
    assert 20 < glided < 200
    world.close()


async def test_robot_glides_until_it_comes_near_something(simulate: Simulate, monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = simulate("empty", start=Pose(4.0, 5.0))
    await settled(simulation)
    stepped = list[float]()
    step = mujoco.mj_step

    def noting(model: mujoco.MjModel, data: mujoco.MjData, nstep: int) -> None:
        stepped.append(simulation.pose.x)
        step(model, data, nstep=nstep)

    monkeypatch.setattr(mujoco, "mj_step", noting)
    simulation.robot[Base].set_velocity(Twist(0.3))
    ahead = simulation.pose.compose(Pose(1.2))
    simulation.world.stage.add_obstacle(ahead, (0.2, 0.2, 0.5))
    await simulation.clock.advance(1.0)
    assert stepped == []
    await simulation.clock.advance(3.0)
    assert stepped
    assert simulation.world._physics.hulls["a"].touches


async def test_contacts_of_standing_robots_are_not_searched(simulate: Simulate) -> None:
    simulation = simulate("empty")
    await settled(simulation)
    options = simulation.world._physics._model.opt
    assert options.disableflags & NO_CONTACTS
    simulation.world.stage.add_obstacle(simulation.pose.compose(Pose(0.35)), (0.2, 0.2, 0.5))
    await simulation.clock.advance(0.02)
    assert not options.disableflags & NO_CONTACTS
    await simulation.clock.advance(0.1)
    assert options.disableflags & NO_CONTACTS
    simulation.robot[Base].set_velocity(Twist(0.3))
    await simulation.clock.advance(0.1)
    assert not options.disableflags & NO_CONTACTS


async def test_distance_of_walls_is_never_overrated(simulate: Simulate) -> None:
    """Edges of the floor are looked up more often than walls: the lift's shaft is nearer."""
    simulation = simulate("office", start=Pose(6.0, 10.0))
    physics, dice = simulation.world._physics, random.Random(1)
    hull = physics.hulls["a"]
    row = physics._hull_rows[0]
    for _ in range(30):
        pose, way = Pose(dice.uniform(1.5, 9.0), dice.uniform(9.0, 11.0)), dice.uniform(-3.2, 3.2)
        hull.place(pose, 0)
        for _ in range(60):
            physics._data.qpos[:2] += 0.02 * np.cos(way), 0.02 * np.sin(way)
            hull.look()
            gone = abs(hull.x - row[HULL_LOOKUP_X]) + abs(hull.y - row[HULL_LOOKUP_Y])
            assert row[HULL_WALLS] - gone <= physics.walls.room(hull.x, hull.y, 0) + 1e-9


async def story(seed: int, *, moves_freely: bool) -> list[list[tuple[bool, float, float]]]:
    """Return touches and places by tick and robot, while robots drive and hands do all they can."""
    clock, dice = LockstepClock(), random.Random(seed)
    names = {f"r{index}": dice.choice(BODIES) for index in range(dice.randint(1, 3))}
    world = World(load_world("office"), [RobotPlacement(*one) for one in names.items()], clock=clock, seed=seed)
    for name in names:
        world.equip(Robot(name, world.description_of(name), clock))
    physics, hands = world._physics, world.own_stage
    physics.tables.load_kernels()
    if moves_freely:
        physics.load_kernels()
    else:
        physics._free_motion = physics._contact_switch._free_motion = None
    world.start()
    seen = []
    for tick in range(500):
        for name in names if tick % 25 == 10 else ():
            what, pose = dice.random(), world.truth.pose_of(name)
            near = pose.compose(Pose(dice.uniform(-0.8, 0.8), dice.uniform(-0.8, 0.8)))
            twist = Twist(dice.choice((0.0, 0.2, 0.5, 1.0, -0.3)), 0.0, dice.choice((0.0, 1.0, -1.0)))
            with contextlib.suppress(Collided, Refused, ValueError):
                if what < 0.7:
                    world.robots[name][Base].set_velocity(twist)
                elif what < 0.8:
                    hands.push(name, Vector3(dice.uniform(-8.0, 8.0), dice.uniform(-8.0, 8.0), 0.0))
                elif what < 0.9:
                    touching = physics.hulls[name].body.hull.radius + dice.uniform(0.092, 0.105)
                    beside = pose.compose(Pose(dice.choice((touching, -touching)), 0.0))
                    hands.add_obstacle(beside, (0.2, 0.3, dice.choice((0.05, 0.5))))
                else:
                    hands.place(name, near)
        await clock.advance(0.02)
        seen.append([(bool(hull.touches), hull.x, hull.y) for hull in physics.hulls.values()])
    world.close()
    return seen


@pytest.mark.parametrize("seed", [3, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(4, 15))])
async def test_touches_are_those_of_mujoco(seed: int) -> None:
    free_motion, stepping = await story(seed, moves_freely=True), await story(seed, moves_freely=False)
    assert any(touches for tick in stepping for touches, _, _ in tick)
    for glided, stepped in zip(free_motion, stepping, strict=True):
        assert [touches for touches, _, _ in glided] == [touches for touches, _, _ in stepped]
        assert np.allclose(glided, stepped, rtol=0.0, atol=1e-3)


@pytest.mark.parametrize("compiled", [False, True])
async def test_rising_robot_meets_what_hangs_above(simulate: Simulate, *, compiled: bool) -> None:
    world = load_world("empty")
    board = Box(at=(4.0, 5.0), size=(0.6, 0.6, 0.05), base=0.3)
    room = replace(world.floors[0], furniture=(board,))
    simulation = simulate(replace(world, floors=(room,)), start=Pose(6.0, 5.0), body="cyberdog2", compiled=compiled)
    simulation.world.start()
    simulation.robot[Legs].lie_down()
    await simulation.clock.advance(5.0)
    simulation.world.stage.place("a", Pose(4.0, 5.0))
    await simulation.clock.advance(1.0)
    hull = simulation.world._physics.hulls["a"]
    assert not hull.touches
    simulation.robot[Legs].stand()
    await simulation.clock.advance(5.0)
    assert hull.touches
    assert hull.belly + hull.body.hull.torso_height < 0.32


async def test_robot_that_leans_glides(simulate: Simulate, monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = simulate("empty", start=Pose(4.0, 5.0))
    await settled(simulation)
    base, hull = simulation.robot[Base], simulation.world._physics.hulls["a"]
    simulation.world.stage.add_obstacle(simulation.pose.compose(Pose(0.6)), (0.2, 0.2, 0.5))
    base.set_velocity(Twist(0.3))
    await simulation.clock.advance(3.0)
    assert hull.touches
    base.set_velocity(Twist(yaw=1.0))
    await simulation.clock.advance(0.2)
    steps = list[int]()
    step = mujoco.mj_step

    def noting(model: mujoco.MjModel, data: mujoco.MjData, nstep: int) -> None:
        steps.append(nstep)
        step(model, data, nstep=nstep)

    monkeypatch.setattr(mujoco, "mj_step", noting)
    (touch, *_), turned = hull.touches, hull.turned
    await simulation.clock.advance(0.5)
    assert steps == []
    (after, *_), turn = hull.touches, hull.turned - turned
    assert math.atan2(after.y, after.x) == pytest.approx(math.atan2(touch.y, touch.x) - turn, abs=1e-6)
    base.set_velocity(Twist(-0.3))
    await simulation.clock.advance(1.0)
    assert steps
    assert not hull.touches
