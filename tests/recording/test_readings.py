"""Each row of ``READINGS`` fits its sensor, and has a ROS message."""

from __future__ import annotations

import json
from typing import Any

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.protocols.ros2.table import Messages
from roboglot.recording.reader import Record
from roboglot.recording.readings import READINGS, Reading, readings_of
from roboglot.recording.ros2.translation import Ros2Translator, read_cdr
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world


@pytest.mark.parametrize("reading", READINGS, ids=lambda reading: reading.topic)
def test_reading_becomes_its_ros_message(reading: Reading) -> None:
    data = json.dumps(dict.fromkeys(reading.names, 2.0)).encode()
    [message] = Ros2Translator().translate(Record(f"/a/{reading.topic}", reading.schema, 0, data))
    decoded: Any = read_cdr(message.data, reading.ros)
    assert (message.topic, decoded.header.frame_id) == (f"/a/{reading.topic}", "a/base_link")
    assert reading.topic in Messages.implemented()


async def test_rows_name_the_types_of_their_sensors() -> None:
    clock = LockstepClock()
    world = World(load_world("empty"), [RobotPlacement("a", "universal")], clock=clock, seed=1)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    types = {topic: type(value) for topic, value in readings_of(robot)}
    world.close()
    assert types == {reading.topic: reading.value for reading in READINGS if reading.component in robot}
    assert "pressure" in types
