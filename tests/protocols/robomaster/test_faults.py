"""Faults in the words of the text protocol, which has few: numbers that show it, and ``fail``."""

import asyncio

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.drivers.settling import settle

REFUSED = {"emergency_stop", "brake_released"}


async def reply_to(client, clock: LockstepClock, text: str) -> str:
    reply = asyncio.ensure_future(client.ask(text))
    while not reply.done():
        await clock.advance(0.05)
        await settle()
    return await reply


@pytest.mark.world("empty")
async def test_moves_fail(client, world: World, clock: LockstepClock, forward: Forward) -> None:
    assert await reply_to(client, clock, "chassis move x 1 wait_for_complete true;") == "ok;"
    for kind in ("cliff", "emergency_stop", "brake_released"):
        world.faults.inject(kind, "a")
        await forward(seconds=0.5)
        assert await reply_to(client, clock, "chassis move x 0.2 wait_for_complete true;") == "fail;", kind
        assert await reply_to(client, clock, "chassis speed z 20;") == ("fail;" if kind in REFUSED else "ok;"), kind
        world.faults.clear()
        await forward(seconds=1)


@pytest.mark.world("empty")
async def test_faults_change_the_reported_numbers(client, world: World, clock: LockstepClock, forward: Forward) -> None:
    await reply_to(client, clock, "ir_distance_sensor measure on;")
    await forward(seconds=0.3)
    far = float((await reply_to(client, clock, "ir_distance_sensor distance 1 ?;")).rstrip(";"))
    world.faults.inject("blocked_path", "a", ahead=1.0)
    world.faults.inject("low_battery", "a", charge=0.07)
    world.faults.inject("motor_fault", "a", wheel="front_left")
    await forward(seconds=0.3)
    assert float((await reply_to(client, clock, "ir_distance_sensor distance 1 ?;")).rstrip(";")) < min(
        600.0, far
    )  # mm
    world.faults.inject("range_sensor_gone", "a")
    assert await reply_to(client, clock, "ir_distance_sensor distance 1 ?;") == "0.0;"
    assert await reply_to(client, clock, "ir_distance_sensor distance 2 ?;") != "0.0;"
    assert await reply_to(client, clock, "robot battery ?;") == "7;"
    await reply_to(client, clock, "chassis wheel w1 20 w2 20 w3 20 w4 20;")
    await forward(seconds=0.3)
    wheels = [float(word) for word in (await reply_to(client, clock, "chassis speed ?;")).rstrip(";").split()][3:]
    assert wheels.count(0.0) == 1
    assert max(map(abs, wheels)) > 5
