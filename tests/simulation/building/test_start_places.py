"""Start places of many robots: side by side while they are few, then over the rooms, with room ahead."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from msgspec.structs import replace as replace_parts

from roboglot.model.geometry import Pose
from roboglot.simulation.building.rooms import Rooms, rooms_of
from roboglot.simulation.world.description import Hole
from roboglot.simulation.world.placing import AHEAD, BESIDE, DOOR, TOGETHER, Places
from roboglot.simulation.world.world_files import load_world

RADII = (0.25, 0.22, 0.3)


def spread(world: str, count: int) -> tuple[list[tuple[Pose, float]], Rooms]:
    """Return places and radii of so many robots on the ground floor, and its rooms."""
    description = load_world(world)
    places = Places(description)
    radii = [RADII[n % len(RADII)] for n in range(count)]
    found = [(places.next(None, 0, radius)[0], radius) for radius in radii]
    return found, rooms_of(description.floors[0], description.lift)


def room_of(rooms: Rooms, pose: Pose) -> int:
    """Return the number of the room where this is."""
    (number,) = (n for n, cells in enumerate(rooms.rooms) if rooms.cell_at(pose.x, pose.y) in cells)
    return number


def test_few_robots_start_side_by_side() -> None:
    placed, rooms = spread("office", TOGETHER)
    assert len({room_of(rooms, pose) for pose, _ in placed}) == 1


@pytest.mark.parametrize("count", [25, 60])
def test_many_robots_start_in_all_rooms(count: int) -> None:
    placed, rooms = spread("office", count)
    crowds = [0] * len(rooms.rooms)
    for pose, _ in placed:
        crowds[room_of(rooms, pose)] += 1
    assert min(crowds) >= 1
    assert max(crowds) <= max(TOGETHER, 1.6 * count / len(crowds))
    before = Places(load_world("office"), _taken=[(pose, 0, radius) for pose, radius in placed[:TOGETHER]])
    stand = [person.path[0] for person in load_world("office").floors[0].people]
    for pose, radius in placed[TOGETHER:]:
        assert before.free(pose, 0, radius + 0.4 * BESIDE)
        assert all(before.free(pose.compose(Pose(AHEAD * n / 4)), 0, radius + 0.1) for n in range(1, 5))
        assert all(pose.distance_to(other.compose(Pose(AHEAD))) >= radius + r for other, _, r in before._taken)
        assert all(math.dist((pose.x, pose.y), at) > radius + 0.4 for at in stand)
        assert all(math.dist((pose.x, pose.y), door) >= DOOR + radius for door in rooms.doors)
        before = replace(before, _taken=[*before._taken, (pose, 0, radius)])


def test_doors_part_rooms_and_gaps_join() -> None:
    rooms = rooms_of(load_world("office").floors[0], load_world("office").lift)
    assert sorted(round(rooms.area(n)) for n in range(len(rooms.rooms)))[-1] < 90  # m²: the corridor
    assert len(rooms.rooms) == 9
    corridor = load_world("tests/autonomy/worlds/one_corridor.toml").floors[0]
    assert len(rooms_of(corridor, None).rooms) == 1  # it opens into a hall


WAYS = {  # in the office, for a radius of 0.25 m
    "a wall": (Pose(15.0, 0.1), 0),
    "furniture": (Pose(4.0, 2.0), 0),
    "a person": (Pose(3.2, 10.2), 0),
    "a dock": (Pose(22.5, 8.88), 0),
    "a gap in the floor": (Pose(1.15, 10.0), 1),  # the lift's car is below
    "another robot": (Pose(15.4, 10.0), 0),
}


@pytest.mark.parametrize("what", WAYS)
def test_no_robot_starts_in_anything(what: str) -> None:
    places = Places(load_world("office"), _taken=[(Pose(15.0, 10.0), 0, 0.25)])
    with pytest.raises(ValueError, match=f": {what} is in the way; it can at"):
        places.next(*WAYS[what], 0.25)


@pytest.mark.parametrize("pose", [Pose(math.nan, 5.0), Pose(5.0, math.inf), Pose(5.0, 5.0, math.nan), Pose(-3.0, 5.0)])
def test_no_robot_starts_outside(pose: Pose) -> None:
    with pytest.raises(ValueError, match="has no place"):
        Places(load_world("office")).next(pose, 0, 0.25)


def test_robots_without_places_keep_off_people_and_holes() -> None:
    empty = load_world("empty")
    (dock,) = empty.floors[0].docks
    front = dock.pose.compose(Pose(0.255))
    (person, *_) = load_world("office").floors[0].people
    for changed in (
        replace_parts(empty.floors[0], people=(replace_parts(person, path=((front.x, front.y),)),)),
        replace_parts(empty.floors[0], holes=(Hole(at=(front.x, front.y), size=(0.2, 0.2)),)),
    ):
        (pose, _) = Places(replace_parts(empty, floors=(changed,))).next(None, 0, 0.25)
        assert pose.distance_to(front) > 0.1
