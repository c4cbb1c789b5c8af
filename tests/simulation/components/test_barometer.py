"""The barometer feels the height of the robot above the sea, floor by floor."""

from __future__ import annotations

import pytest

from roboglot.model.components.sensing.barometer import Barometer
from roboglot.model.geometry import Pose
from roboglot.simulation.components.sensing.barometer import pressure_at

OFFSET = 4 * 30.0  # Pa: four standard deviations of the sensor's own error


async def test_pressure_is_that_of_the_height(simulate):
    sim = simulate("office", body="universal")
    reading = sim.robot[Barometer].reading
    reference = sim.world.description.georeference
    height = reference.altitude if reference else 0.0
    assert reading.pressure == pytest.approx(pressure_at(height), abs=OFFSET)


async def test_next_floor_is_measured_with_any_offset(simulate):
    sim = simulate("office", body="universal")
    ground = sim.robot[Barometer].reading.pressure
    sim.world.stage.place("a", Pose(6.0, 10.0), floor=1)
    await sim.clock.advance(1.0)
    first = sim.robot[Barometer].reading.pressure
    climbed = sim.world.description.elevation(1)
    assert ground - first == pytest.approx(12.0 * climbed, abs=12.0)


def test_the_standard_atmosphere_at_a_kilometre():
    assert pressure_at(1000.0) == pytest.approx(89_875, abs=15)  # ISO 2533, table


async def test_one_value_until_the_next_is_due(simulate):
    sim = simulate("empty", body="universal")
    await sim.clock.advance(1.0)
    barometer = sim.robot[Barometer]
    assert barometer.reading is barometer.reading
    before = barometer.reading
    await sim.clock.advance(0.2)
    assert barometer.reading.stamp == pytest.approx(before.stamp + 0.2)
