"""Walls with doors, floors with shafts, people with room to walk."""

import math

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.building.blueprint import SolidKind, slabs_of, solids_of
from roboglot.simulation.world.description import Floor, Opening, Wall
from roboglot.simulation.world.placing import Places
from roboglot.simulation.world.world_files import load_world


def test_doors_cut_a_wall_into_pieces():
    wall = Wall(start=(1, 1), end=(1, 9), doors=(Opening(at=6, width=1), Opening(at=2, width=2)))
    floor = Floor(size=(10, 10), enclosed=False, walls=(wall,))
    pieces = [
        (round(s.pose.y - s.size[0] / 2, 6), round(s.pose.y + s.size[0] / 2, 6)) for s in solids_of(floor, None, False)
    ]
    assert pieces == [(1, 2), (4, 6.5), (7.5, 9)]


def test_slabs_leave_the_shaft_open_and_nothing_else():
    world = load_world("office")
    slabs = list(slabs_of(world.floors[0], world.lift))
    assert sum(s.width * s.depth for s in slabs) == pytest.approx(30 * 20 - 1.6 * 1.6)
    x, y = world.lift.at
    assert not any(s.x < x < s.x + s.width and s.y < y < s.y + s.depth for s in slabs)


@pytest.mark.parametrize("name", ["office", "empty", "playground"])
def test_in_shipped_worlds_people_walk_through_nothing(name):
    world = load_world(name)
    for number, floor in enumerate(world.floors):
        for person in floor.people:
            for a, b in zip(person.path, person.path[1:] or person.path, strict=False):
                for step in range(51):
                    spot = Pose(a[0] + (b[0] - a[0]) * step / 50, a[1] + (b[1] - a[1]) * step / 50)
                    assert Places(world).free(spot, number, person.radius)


@pytest.mark.parametrize("name", ["office", "empty", "playground"])
def test_docks_stand_against_something_and_look_into_open(name):
    world = load_world(name)
    for number, floor in enumerate(world.floors):
        for dock in floor.docks:
            for ahead in (0.255, 0.5, 1.0):
                Places(world).next(dock.pose.compose(Pose(ahead)), number, 0.25)
            with pytest.raises(ValueError, match=r"cannot stand|has no place"):
                Places(world).next(dock.pose.compose(Pose(-0.3)), number, 0.25)


async def test_robot_drives_into_the_parked_lift_car(simulate):
    sim = simulate("office", start=Pose(2.4, 9.9, math.pi))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(8.0)
    assert sim.pose.x == pytest.approx(0.15 + 0.25, abs=0.02)  # at the back wall of the shaft
    assert sim.world.truth.floor_of("a") == 0
    assert abs(sim.world._physics.hulls["a"].elevation) < 0.005


async def test_landing_door_is_shut_where_car_is_not(simulate):
    sim = simulate("office", start=Pose(3.5, 10.0, math.pi), floor=1)
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(8.0)
    assert sim.pose.x == pytest.approx(1.75 + 0.1 + 0.25, abs=0.02)
    assert sim.world.truth.floor_of("a") == 1
    assert any(
        s.kind is SolidKind.LANDING_DOOR
        for s in solids_of(sim.world.description.floors[1], sim.world.description.lift, False)
    )
