"""Faults in the CyberDog's words: the self check, the state, the numbers of 1001, the codes of motions."""

import asyncio
from typing import Any

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.drivers.settling import settle

# kind: robot time until it is reported, the self check's code, the state, the code of walking
WORDS = {
    "low_battery": (0.5, 0, 1, 3013),
    "motor_fault": (0.5, 2, 0, 3032),
    "lidar_gone": (1.5, 4, 0, 0),
    "bumper_stuck": (6.0, 4, 0, 0),
    "range_sensor_gone": (0.5, 4, 0, 0),
    "full_disk": (0.5, 4, 0, 0),
    "wifi_loss": (1.5, 0, 0, 0),
}


async def asked(client, clock: LockstepClock, code: int, **params: Any) -> Any:
    answer = asyncio.ensure_future(client.ask(code, params))
    while not answer.done():
        await clock.advance(0.05)
        await settle()
    return await answer


@pytest.mark.slow
@pytest.mark.world("empty", body="cyberdog2")
async def test_words(client, world: World, clock: LockstepClock, forward: Forward) -> None:
    await forward(seconds=0.5)
    for kind, (seconds, check, state, walking) in WORDS.items():
        world.faults.inject(kind, "a")
        await forward(seconds=seconds)
        status, about = (
            await asked(client, clock, 10001),
            await asked(client, clock, 1001, is_wifi=True, is_bat_info=True),
        )
        walked = await asked(client, clock, 1004, motion_id=304, vel_des=[0.0, 0.0, 0.3], duration=200)
        assert (status["self_check_status"]["code"], status["state_switch_status"]["state"]) == (check, state), kind
        assert walked["code"] == walking, kind
        assert (about["bat_info"]["power"] == 10) == (kind == "low_battery")
        assert (about["wifi"]["strength"] == 0 and not about["wifi"]["name"]) == (kind == "wifi_loss")
        world.faults.clear()
        await forward(seconds=1.5)


STOPPED = {"emergency_stop": (4, 3040), "brake_released": (2, 3040), "depth_camera_gone": (4, 0)}


@pytest.mark.world("empty", body="universal")
async def test_words_of_a_body_with_a_button(client, world: World, clock: LockstepClock, forward: Forward) -> None:
    await forward(seconds=0.5)
    for kind, (check, walking) in STOPPED.items():
        world.faults.inject(kind, "a")
        await forward(seconds=0.5)
        assert (await asked(client, clock, 10001))["self_check_status"]["code"] == check, kind
        walked = await asked(client, clock, 1004, motion_id=304, vel_des=[0.0, 0.0, 0.3], duration=200)
        assert walked["code"] == walking, kind
        world.faults.clear()
        await forward(seconds=1.5)
