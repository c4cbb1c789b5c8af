"""A world saved as a file and loaded again."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.geometry import Pose, Vector3
from roboglot.simulation.world.description import Box
from roboglot.simulation.world.saving import world_toml
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import WORLDS, load_world


@pytest.mark.parametrize("name", sorted(path.stem for path in WORLDS.glob("*.toml")))
def test_shipped_worlds_survive_the_round_trip(name: str, tmp_path: Path) -> None:
    world = load_world(name)
    whole = [msgspec.structs.replace(floor, like="") for floor in world.floors]  # it contains its walls already
    path = tmp_path / "saved.toml"
    path.write_text(world_toml(msgspec.structs.replace(world, floors=tuple(whole))), encoding="utf-8")
    assert load_world(str(path)) == msgspec.structs.replace(world, floors=tuple(whole))


async def test_changes_by_hands_are_saved(tmp_path: Path) -> None:
    world = World(load_world("playground"), [RobotPlacement("a", "universal")], clock=LockstepClock())
    stage = world.stage
    stage.add_obstacle(Pose(2.0, 1.5, math.pi / 6), (0.5, 0.3, 0.8))
    stage.move_obstacle(stage.obstacles[0].number, Pose(2.5, 1.5, 0.0), 0)
    stage.add_tag("12", Pose(1.0, 2.0, math.pi / 2), height=0.5, size=0.2)
    stage.place("a", Pose(3.0, 2.0, 1.0))
    person = stage.people[0]
    stage.person(person.name).place(1.5, 1.0, 45.0)
    stage.person(person.name).stand()
    path = tmp_path / "now.toml"
    path.write_text(stage.world_file(), encoding="utf-8")
    again = World(load_world(str(path)), [RobotPlacement("a", "universal")], clock=LockstepClock())
    robot = again.stage.robots[0].pose
    assert (robot.x, robot.y, robot.yaw) == pytest.approx((3.0, 2.0, 1.0), abs=1e-3)
    box = load_world(str(path)).floors[0].furniture[-1]
    assert isinstance(box, Box)
    assert (box.at, box.size) == ((2.5, 1.5), (0.5, 0.3, 0.8))
    tag = load_world(str(path)).floors[0].tags[-1]
    assert (tag.text, tag.at, tag.facing, tag.height, tag.size) == ("12", (1.0, 2.0), 90.0, 0.5, 0.2)
    standing = next(p for p in again.stage.people if p.name == person.name).pose
    assert (standing.x, standing.y, math.degrees(standing.yaw)) == pytest.approx((1.5, 1.0, 45.0), abs=1e-3)


async def test_people_who_came_and_went_are_saved(tmp_path: Path) -> None:
    world = World(load_world("office"), [RobotPlacement("a", "universal")], clock=LockstepClock())
    stage = world.stage
    gone, *others = [person.name for person in stage.people]
    stage.remove_person(gone)
    came = stage.add_person(Pose(8.0, 10.0, math.pi / 2), name="Ann")
    path = tmp_path / "now.toml"
    path.write_text(stage.world_file(), encoding="utf-8")
    again = World(load_world(str(path)), [RobotPlacement("a", "universal")], clock=LockstepClock())
    assert len(again.stage.people) == len(others) + 1
    ann = again.stage.person(came).pose
    assert (ann.x, ann.y, ann.yaw) == pytest.approx((8.0, 10.0, math.pi / 2), abs=1e-3)


async def test_things_are_where_they_were_left(tmp_path: Path) -> None:
    world = World(load_world("obstacle_course"), [RobotPlacement("a", "universal")], clock=LockstepClock())
    world.stage.move_thing("can", Vector3(2.5, 6.5, 0.0))
    path = tmp_path / "now.toml"
    path.write_text(world.stage.world_file(), encoding="utf-8")
    (can,) = (thing for thing in load_world(str(path)).floors[0].things if thing.name == "can")
    assert can.at == (2.5, 6.5)
