"""Start places of robots that no one placed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from roboglot.config import parse_robot
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.files import load_body
from roboglot.simulation.world.placing import AHEAD, Places
from roboglot.simulation.world.world_files import load_world

BODIES = ("universal", "hermes", "robomaster_ep", "cyberdog2", "universal", "universal")
RADII = [load_body(name).hull.radius for name in BODIES]
CORRIDOR = 8.5, 11.5  # m, of y


@pytest.fixture
def places() -> Places:
    return Places(load_world("office"))


def test_robots_start_in_one_room_and_can_leave(places: Places) -> None:
    stand = [(places.next(None, 0, radius)[0], radius) for radius in RADII]
    for pose, radius in stand:
        assert CORRIDOR[0] < pose.y - radius < pose.y + radius < CORRIDOR[1]
        ahead = pose.compose(Pose(AHEAD))
        assert Places(places.world).free(ahead, 0, radius)
        others = [(other, r) for other, r in stand if other is not pose]
        assert all(min(place.distance_to(other) for place in (pose, ahead)) >= radius + r for other, r in others)


def test_a_crowd_stands_wherever_there_is_room(places: Places) -> None:
    stand = [places.next(None, 0, 0.25)[0] for _ in range(100)]
    assert all(a.distance_to(b) >= 0.5 for i, a in enumerate(stand) for b in stand[:i])
    assert any(not CORRIDOR[0] < pose.y < CORRIDOR[1] for pose in stand)


def test_robot_with_given_place_stands_there_or_nowhere(places: Places) -> None:
    wanted = Pose(20.0, 10.0, 1.0)
    assert places.next(wanted, 0, 0.25) == (wanted, 0)
    with pytest.raises(ValueError, match="cannot stand"):
        places.next(Pose(20.2, 10.0), 0, 0.25)


def test_first_robot_of_bare_world_stands_in_middle(tmp_path: Path) -> None:
    bare = tmp_path / "bare.toml"
    bare.write_text('name = "bare"\n[[floors]]\nname = "hall"\nsize = [6, 4]\n')
    places = Places(load_world(bare))
    assert places.next(None, 0, 0.25) == (Pose(3.0, 2.0), 0)
    assert places.next(None, 0, 0.25) == (Pose(3.0, 1.2), 0)


def test_refusal_names_a_place_nearby_that_is_free(places: Places) -> None:
    with pytest.raises(ValueError, match="cannot stand at") as refused:
        places.next(Pose(3.0, 2.0), 0, 0.3)
    x, y = map(float, str(refused.value).rpartition(" ")[2].split(","))
    assert Pose(3.0, 2.0).distance_to(Pose(x, y)) < 1.0
    assert places.next(Pose(x, y), 0, 0.3) == (Pose(x, y), 0)


def test_example_of_the_documents_starts(places: Places) -> None:
    text = (Path(__file__).parents[3] / "docs" / "scale.md").read_text()
    shown = [parse_robot(robot) for robot in re.findall(r"--robot (\w+=\S+)", text)]
    assert len(shown) >= 2
    for robot in shown:
        assert robot.start is not None
        start = Pose(robot.start.x, robot.start.y, robot.start.yaw)
        assert places.next(start, robot.start.floor, load_body(robot.body).hull.radius)[0] == start
