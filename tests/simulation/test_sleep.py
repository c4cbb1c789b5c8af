"""The physics sleeps while nothing moves and nothing asks for motion; sensors see what walks by all the same."""

from __future__ import annotations

import numpy as np

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs
from roboglot.model.geometry import Pose, Twist, Vector3

from .conftest import Simulate, Simulation


def asleep(simulation: Simulation) -> bool:
    """True if the last tick did without a step."""
    physics = simulation.world._physics
    return physics._contact_switch.off and physics._sleep.lasts


async def resting(simulation: Simulation) -> bool:
    """Let time pass, enough to come to rest."""
    await simulation.clock.advance(3.0)
    return asleep(simulation)


async def test_physics_sleep_until_a_robot_moves(simulate: Simulate) -> None:
    simulation = simulate("empty")
    simulation.world.start()
    assert await resting(simulation)
    there = simulation.pose
    simulation.robot[Base].set_velocity(Twist(0.3))
    await simulation.clock.advance(0.1)
    assert not asleep(simulation)
    assert simulation.pose != there
    simulation.robot[Base].set_velocity(Twist())
    assert await resting(simulation)


async def test_stage_wake_the_physics(simulate: Simulate) -> None:
    simulation = simulate("empty")
    simulation.world.start()
    assert await resting(simulation)
    there = simulation.pose
    simulation.world.stage.push(simulation.robot.id, Vector3(50.0))
    await simulation.clock.advance(0.1)
    assert simulation.pose != there
    assert await resting(simulation)
    simulation.world.stage.place(simulation.robot.id, Pose(1.0, 0.5, 0.2))
    await simulation.clock.advance(0.02)
    assert simulation.pose.distance_to(Pose(1.0, 0.5)) < 1e-6


async def test_legs_wake_the_physics(simulate: Simulate) -> None:
    simulation = simulate("empty")
    simulation.world.start()
    assert await resting(simulation)
    hull = simulation.world._physics.hulls[simulation.robot.id]
    stood = hull.belly
    simulation.robot[Legs].lie_down()
    await simulation.clock.advance(3.0)
    assert hull.belly < stood - 0.05


async def test_rays_meet_who_walks_by_a_sleeper(simulate: Simulate) -> None:
    simulation = simulate("empty")
    world, hull = simulation.world, simulation.world._physics.hulls[simulation.robot.id]
    world.start()
    person = world.stage.add_person(simulation.pose.compose(Pose(3.0)))
    assert await resting(simulation)
    origin = hull.position + np.array((0.0, 0.0, 0.5))
    ahead = np.array([[np.cos(hull.turned), np.sin(hull.turned), 0.0]])
    (near,) = world._physics.rays.cast(origin[None], ahead, 10.0, hull)
    there = simulation.pose.compose(Pose(4.0))
    world.stage.person(person).place(there.x, there.y)
    await simulation.clock.advance(0.02)
    (far,) = world._physics.rays.cast(origin[None], ahead, 10.0, hull)
    assert asleep(simulation)
    assert abs(far - near - 1.0) < 0.01
