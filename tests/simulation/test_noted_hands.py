"""Hands that are noted, and their doings once more in another world."""

from __future__ import annotations

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Point, Pose, Vector3
from roboglot.model.inputs.noted_stage import do_again
from roboglot.model.inputs.outside import Input
from roboglot.model.perception import Gesture
from roboglot.model.robot import Robot
from roboglot.model.sound import claps
from roboglot.recording.messages import decode_input, encode_input
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world


def world() -> World:
    clock = LockstepClock()
    built = World(load_world("office"), [RobotPlacement("a", "universal")], clock=clock)
    built.equip(Robot("a", built.description_of("a"), clock))
    return built


async def test_hands_do_the_same_in_another_world() -> None:
    first, second, noted = world(), world(), list[Input]()
    hands = first.hands
    hands.add_obstacle(Pose(1.0, 1.0))  # before they are recorded
    second.hands.add_obstacle(Pose(1.0, 1.0))
    first.outside.listen(noted.append)
    number = hands.add_obstacle(Pose(2.0, 1.0, 0.5), (0.3, 0.2, 1.0))
    hands.move_obstacle(number, Pose(2.5, 1.0), 0)
    hands.place("a", Pose(0.5, 0.4, 1.0))
    hands.push("a", Vector3(3.0, 1.0, 0.0))
    hands.pull("a", Point(1.0, 0.0))
    hands.touch("a", TouchKind.DOUBLE)
    hands.make_sound(claps(1), Point(1.0, 1.0), loudness=0.5)
    hands.inject_fault("blocked_path", "a", duration=3.0, ahead=1.5)
    name = hands.add_person(Pose(1.5, 1.5), name="Ann")
    hands.person(name).gesture(next(iter(Gesture)), seconds=2.0)
    with pytest.raises(NotFound):
        hands.remove_person("no one")
    assert [one.name for one in noted] == [
        *("add_obstacle", "move_obstacle", "place", "push", "pull", "touch", "make_sound", "inject_fault"),
        *("add_person", "gesture", "remove_person"),
    ]
    for one in noted[:-1]:
        do_again(second.hands, decode_input(encode_input(one)))
    assert second.hands.world_file() == hands.world_file()
    assert second.hands.obstacles == hands.obstacles
    assert second.hands.faults == hands.faults


# Refused when it was done first, so it is noted with these values.
OPTIONS = [("inject_fault", {"kind": "blocked_path", "robot": "a", "options": {"ahead": "far"}})]


@pytest.mark.parametrize(
    ("name", "values"), [("world_file", {}), ("__init__", {}), ("push", {"name": 3}), ("fly", {}), *OPTIONS]
)
async def test_unknown_inputs_of_hands_are_refused(name: str, values: dict[str, object]) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - each has its own words
        do_again(world().hands, Input(0.0, 0, "", "hands", name, values))
