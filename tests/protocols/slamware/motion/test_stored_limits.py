"""Settings that cannot be stored stay as they were, in memory and after a restart."""

from __future__ import annotations

import json
from collections.abc import Callable

import httpx
import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.storage.settings import StoredSettings
from roboglot.storage.transactions import Connection, DatabaseError

pytestmark = pytest.mark.world("empty")
MASKS, CUBE = "/api/core/sensors/v1/masks", "/api/core/system/v1/cube/config"
CONFIG = json.dumps({"max_moving_speed": 0.4, "disabled_sensors": [1]})


async def test_full_disk_leaves_sensors_and_limits(world: World, robot: Robot, client: httpx.AsyncClient) -> None:
    off = [{"id": 0, "isAlways": True, "isEnabled": False}, {"id": 1, "isAlways": False, "isEnabled": False}]
    assert (await client.put(MASKS, json=off)).json() is True
    before = robot[SensorMasks].masked, robot[Base].limits.twist
    (fault,) = world.faults.inject("full_disk", "a")
    other = [{"id": 0, "isAlways": True, "isEnabled": True}, {"id": 2, "isAlways": True, "isEnabled": False}]
    assert (await client.put(MASKS, json=other)).status_code == 403
    assert (await client.put(CUBE, content=CONFIG)).status_code == 403
    assert (robot[SensorMasks].masked, robot[Base].limits.twist) == before == ({0: True, 1: False}, before[1])
    world.faults.clear(fault.number)
    assert (await client.put(MASKS, json=other)).json() is True
    assert robot[SensorMasks].masked == {1: False, 2: True}


@pytest.mark.parametrize("failing", ["slamware.masked_sensors", "slamware.speed_limits"])
async def test_configuration_is_stored_as_a_whole(
    robot: Robot, client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    """The second write failed and left the first one, which held after the next restart."""
    writing = StoredSettings.writing

    def fail(_: Connection) -> object:
        raise DatabaseError("broken")

    def fails(settings: StoredSettings, key: str, value: object) -> Callable[[Connection], object]:
        return fail if key == failing else writing(settings, key, value)

    with monkeypatch.context() as broken:
        broken.setattr(StoredSettings, "writing", fails)
        reply = await client.put(CUBE, content=CONFIG)
    assert reply.status_code == 500
    keys = "slamware.masked_sensors", "slamware.speed_limits"
    assert [robot[Settings].get(key) for key in keys] == [None, None]
