"""Areas that switch sensors off, on the delivery robot."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from roboglot.fleet import Fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import Area, AreaKind, MapAnnotations
from roboglot.model.components.sensing.sensor_masks import SensorKind, SensorMasks
from tests.autonomy.conftest import Tour
from tests.autonomy.delivery_robot import delivery_robot


@pytest.fixture
async def fleet(clock: LockstepClock) -> AsyncIterator[Fleet]:
    async with delivery_robot(clock) as built:
        yield built


@pytest.mark.slow
async def test_sensors_are_masked_only_inside_the_area(tour: Tour) -> None:
    masks = tour.robot[SensorMasks]
    cliffs = {sensor.id for sensor in masks.sensors if sensor.kind is SensorKind.CLIFF}
    kept = next(sensor.id for sensor in masks.sensors if sensor.kind is SensorKind.BUMPER)
    masks.mask(kept)
    area = Area(0, AreaKind.SENSOR_DISABLE, tour.on_map(17.0, 10.0), tour.on_map(19.0, 10.0), 1.5,
                sensors=frozenset({SensorKind.CLIFF.value}))  # fmt: skip
    await tour.robot[MapAnnotations].change(lambda now: now.with_new(area))
    await tour.go((21.0, 10.0))
    assert set(masks.masked) == {kept}
    await tour.go((18.0, 10.0))
    assert set(masks.masked) == {kept} | cliffs
    await tour.go((15.0, 10.0))
    assert set(masks.masked) == {kept}
