"""The physics looks for contacts only while some may come about: what happens is the same as if it always looked."""

from __future__ import annotations

import contextlib

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.errors import Collided
from roboglot.model.geometry import Pose, Twist, Vector3
from roboglot.simulation.world.contact_switch import ContactSwitch
from roboglot.simulation.world.free_motion import FreeMotion

from .conftest import Simulate, Simulation

WAYS = (Twist(0.3), Twist(-0.2, 0.1, 0.5), Twist(), Twist(0.0, 0.4, -0.3), Twist(0.9), Twist(0.0, 0.0, 1.0))


async def lived(simulation: Simulation) -> tuple[list[object], int, int]:
    """Drive through the office, into walls, people and each other: all that was so, ticks without contacts, touches."""
    world, clock, lives, calm, touched = simulation.world, simulation.clock, list[object](), 0, 0
    physics = world._physics
    world.start()
    await clock.advance(0.5)
    for second in range(24):
        for number, robot in enumerate(simulation.robots.values()):
            with contextlib.suppress(Collided):
                robot[Base].set_velocity(WAYS[(second + 2 * number) % len(WAYS)])
        if second == 7:
            world.stage.place("a", Pose(4.0, 3.5, 1.0))
        if second == 9:
            world.stage.add_obstacle(Pose(4.6, 4.2, 0.3), (0.4, 0.4, 0.5))
        if second == 12:
            there = world.truth.pose_of("b")
            world.stage.add_person(Pose(there.x + 0.5, there.y + 0.3))
        if second == 16:
            world.stage.push("b", Vector3(20.0, 10.0))
        for _ in range(50):
            await clock.advance(0.02)
            calm += bool(physics._model.opt.disableflags)
            for hull in physics.hulls.values():
                touched += bool(hull.touches)
                lives.append((hull.x, hull.y, hull.elevation, hull.turned, list(hull.touches)))
    return lives, calm, touched


@pytest.mark.slow  # compares two worlds; in short: test_robot_at_rest_feels_obstacles
async def test_skipped_contact_searches_miss_no_contact(simulate: Simulate, monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = simulate("office", robots=("a", "b"), seed=3, compiled=False)
    simulation.world._physics.load_kernels()
    monkeypatch.setattr(FreeMotion, "step", lambda *_: False)  # equals MuJoCo's steps up to rounding only
    sparing, calm, touched = await lived(simulation)
    monkeypatch.setattr(ContactSwitch, "look", lambda *_, **__: None)
    thorough, always, _ = await lived(simulate("office", robots=("a", "b"), seed=3, compiled=False))
    assert sparing == thorough
    assert calm > 50
    assert touched > 20
    assert not always


async def test_alone_no_contact_is_looked_for(simulate: Simulate) -> None:
    simulation = simulate("empty")
    options = simulation.world._physics._model.opt
    simulation.world.start()
    simulation.robot[Base].set_velocity(Twist(0.2))  # away from walls
    await simulation.clock.advance(2.0)
    assert options.disableflags
    radius = simulation.robot.description.radius
    simulation.world.stage.add_obstacle(simulation.pose.compose(Pose(radius + 0.11)), (0.2, 0.2, 0.5))
    await simulation.clock.advance(0.02)
    assert not options.disableflags


async def test_robot_in_its_dock_sleeps(simulate: Simulate) -> None:
    simulation = simulate("office")
    physics = simulation.world._physics
    simulation.world.start()
    await simulation.clock.advance(2.0)
    assert physics._contact_switch.off
    assert physics._sleep.lasts


async def test_robot_at_rest_feels_obstacles(simulate: Simulate) -> None:
    simulation = simulate("empty", start=Pose(4.0, 5.0))
    simulation.world.start()
    await simulation.clock.advance(1.0)
    assert simulation.world._physics._contact_switch.off
    radius = simulation.robot.description.radius
    simulation.world.stage.add_obstacle(simulation.pose.compose(Pose(radius + 0.095)), (0.2, 0.2, 0.5))
    await simulation.clock.advance(0.04)
    assert simulation.world._physics.hulls["a"].touches
