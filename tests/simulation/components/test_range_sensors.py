"""Infrared distances equal the geometry."""

import math

import pytest

from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose

RADIUS = 0.17


@pytest.fixture
def sim(simulate):
    sim = simulate(start=Pose(3, 4), body="robomaster_ep")
    sim.world.start()
    return sim


@pytest.fixture
def sensors(sim):
    return sim.robot[RangeSensors]


async def test_they_measure_only_when_switched_on(sim, sensors):
    await sim.clock.advance(0.5)
    assert not sensors.measuring
    assert sensors.reading("ir_1") is None
    sensors.measure(True)
    await sim.clock.advance(0.1)
    assert sensors.reading("ir_1") is not None
    sensors.measure(False)
    assert sensors.reading("ir_1") is None
    with pytest.raises(NotFound):
        sensors.reading("ir_5")


async def test_distances_to_four_walls(sim, sensors):
    sensors.measure(True)
    await sim.clock.advance(0.1)
    walls = {"ir_1": 10 - 3, "ir_2": 10 - 4, "ir_3": 3, "ir_4": 4}  # the room is 10 x 10 m
    for name, distance in walls.items():
        reading = sensors.reading(name)
        assert reading.distance == pytest.approx(distance - RADIUS, rel=0.02)
        assert reading.stamp > 0.0
        assert math.hypot(reading.mount.x, reading.mount.y) == pytest.approx(RADIUS)


async def test_only_things_within_the_cone_count(sim, sensors):
    sensors.measure(True)
    inside = sim.world.stage.add_obstacle(Pose(5.0, 4.3), (0.1, 0.1, 1.0))
    await sim.clock.advance(0.1)
    assert sensors.reading("ir_1").distance == pytest.approx(2.0 - RADIUS - 0.05, abs=0.1)
    sim.world.stage.remove_obstacle(inside)
    sim.world.stage.add_obstacle(Pose(5.0, 4.8), (0.1, 0.1, 1.0))
    await sim.clock.advance(0.1)
    assert sensors.reading("ir_1").distance == pytest.approx(7.0 - RADIUS, rel=0.02)


async def test_nothing_in_reach_reads_infinite(simulate, tmp_path):
    (tmp_path / "hall.toml").write_text('name = "hall"\n[[floors]]\nsize = [30, 30]\n')
    sim = simulate(str(tmp_path / "hall.toml"), start=Pose(15, 15), body="robomaster_ep")
    sim.world.start()
    sim.robot[RangeSensors].measure(True)
    await sim.clock.advance(0.1)
    assert sim.robot[RangeSensors].reading("ir_2").distance == math.inf


async def test_another_robot_and_a_small_thing_are_seen(simulate):
    sim = simulate("obstacle_course", start=Pose(1.1, 6.0), robots=("a", "b"), body="robomaster_ep")
    sim.world.stage.place("b", Pose(1.1, 7.0))
    sim.world.start()
    sim.robot[RangeSensors].measure(True)
    await sim.clock.advance(0.1)
    assert sim.robot[RangeSensors].reading("ir_1").distance == pytest.approx(0.4 - RADIUS - 0.025, abs=0.01)
    assert sim.robot[RangeSensors].reading("ir_2").distance == pytest.approx(1.0 - 2 * RADIUS, rel=0.02)
