"""Robots that nothing can touch move without MuJoCo's steps, as those would move them."""

from __future__ import annotations

import copy
import random

import mujoco
import numpy as np
import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.meetings import NO_CONTACTS
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

from .conftest import Simulate, Simulation

BODIES = ("universal", "cyberdog2", "hermes", "robomaster_ep")
STEPS = 3


async def settled(simulation: Simulation) -> None:
    simulation.world._physics.load_kernels()
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
    gliding, data, model = physics._gliding, physics._data, copy.copy(physics._model)
    assert gliding is not None
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
        if gliding.step(STEPS):
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
    simulation.world.hands.add_obstacle(ahead, (0.2, 0.2, 0.5))
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
    simulation.world.hands.add_obstacle(simulation.pose.compose(Pose(0.35)), (0.2, 0.2, 0.5))
    await simulation.clock.advance(0.02)
    assert not options.disableflags & NO_CONTACTS
    await simulation.clock.advance(0.1)
    assert options.disableflags & NO_CONTACTS
    simulation.robot[Base].set_velocity(Twist(0.3))
    await simulation.clock.advance(0.1)
    assert not options.disableflags & NO_CONTACTS
