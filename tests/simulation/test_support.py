"""A level floor carries robots without contacts; where it ends, or something lifts them, contacts do."""

from __future__ import annotations

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

STANDING = 2e-3  # m by which a robot may sink into a floor


class Scene:
    def __init__(self, world: str = "empty", start: Pose | None = None) -> None:
        self.clock = LockstepClock()
        self.world = World(load_world(world), [RobotPlacement("a", "universal", start)], clock=self.clock, seed=1)
        self.robot = Robot("a", self.world.description_of("a"), self.clock)
        self.world.equip(self.robot)
        self.world._use_kernels()
        self.world.start()
        self.hull = self.world._population.hull("a")


@pytest.fixture
def empty() -> Scene:
    return Scene()


async def test_driving_on_a_level_floor_makes_no_contact(empty: Scene) -> None:
    await empty.clock.advance(1.0)
    empty.robot[Base].set_velocity(Twist(0.5, 0.0, 0.0))
    await empty.clock.advance(1.0)
    assert empty.hull.support.sprung
    assert empty.world._physics._data.ncon == 0
    assert abs(empty.hull.rise) < STANDING
    assert empty.hull.motion[0] ** 2 + empty.hull.motion[1] ** 2 == pytest.approx(0.25, rel=0.01)


async def test_neither_jumps_nor_sinks_when_its_body_moves(empty: Scene) -> None:
    await empty.clock.advance(1.0)
    empty.robot[Legs].lie_down()
    for _ in range(150):
        await empty.clock.advance(0.02)
        assert abs(empty.hull.rise) < 2 * STANDING
    assert empty.hull.support.sprung


async def test_lifted_robot_stands_on_the_floor_again(empty: Scene) -> None:
    await empty.clock.advance(1.0)
    empty.world.stage.lift("a", 0.2)
    await empty.clock.advance(1.0)
    assert not empty.hull.support.sprung
    assert empty.hull.rise == pytest.approx(0.2, abs=0.02)
    empty.world.stage.let_go("a")
    await empty.clock.advance(2.0)
    assert empty.hull.support.sprung
    assert abs(empty.hull.rise) < STANDING


async def test_a_blow_from_below_is_a_flight(empty: Scene) -> None:
    await empty.clock.advance(1.0)
    empty.hull.push(0.0, 0.0, 20.0)
    highest = 0.0
    for _ in range(50):
        await empty.clock.advance(0.02)
        highest = max(highest, empty.hull.rise)
    assert highest > 0.02
    assert abs(empty.hull.rise) < STANDING


async def test_at_edge_of_floor_it_stands_on_contacts() -> None:
    scene = Scene("office")
    shaft = scene.world.description.lift
    assert shaft is not None
    await scene.clock.advance(1.0)
    assert scene.hull.support.sprung
    scene.hull.place(Pose(shaft.at[0], shaft.at[1]), 0)
    await scene.clock.advance(0.5)
    assert not scene.hull.support.sprung
