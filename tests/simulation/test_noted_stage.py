"""Changes through the stage: noted, and repeated in another world."""

from __future__ import annotations

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Point, Pose, Vector3
from roboglot.model.inputs.external import Input
from roboglot.model.inputs.noted_stage import do_again
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


async def test_stage_do_the_same_in_another_world() -> None:
    first, second, noted = world(), world(), list[Input]()
    stage = first.stage
    stage.add_obstacle(Pose(1.0, 1.0))  # before they are recorded
    second.stage.add_obstacle(Pose(1.0, 1.0))
    first.inputs.listen(noted.append)
    number = stage.add_obstacle(Pose(2.0, 1.0, 0.5), (0.3, 0.2, 1.0))
    stage.move_obstacle(number, Pose(2.5, 1.0), 0)
    stage.place("a", Pose(0.5, 0.4, 1.0))
    stage.push("a", Vector3(3.0, 1.0, 0.0))
    stage.pull("a", Point(1.0, 0.0))
    stage.touch("a", TouchKind.DOUBLE)
    stage.make_sound(claps(1), Point(1.0, 1.0), loudness=0.5)
    stage.inject_fault("blocked_path", "a", duration=3.0, ahead=1.5)
    name = stage.add_person(Pose(1.5, 1.5), name="Ann")
    stage.person(name).gesture(next(iter(Gesture)), seconds=2.0)
    with pytest.raises(NotFound):
        stage.remove_person("no one")
    assert [one.name for one in noted] == [
        *("add_obstacle", "move_obstacle", "place", "push", "pull", "touch", "make_sound", "inject_fault"),
        *("add_person", "gesture", "remove_person"),
    ]
    for one in noted[:-1]:
        do_again(second.stage, decode_input(encode_input(one)))
    assert second.stage.world_file() == stage.world_file()
    assert second.stage.obstacles == stage.obstacles
    assert second.stage.faults == stage.faults


# Refused when it was done first, so it is noted with these values.
OPTIONS = [("inject_fault", {"kind": "blocked_path", "robot": "a", "options": {"ahead": "far"}})]


@pytest.mark.parametrize(
    ("name", "values"), [("world_file", {}), ("__init__", {}), ("push", {"name": 3}), ("fly", {}), *OPTIONS]
)
async def test_unknown_inputs_of_hands_are_refused(name: str, values: dict[str, object]) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - each has its own words
        do_again(world().stage, Input(0.0, 0, "", "stage", name, values))
