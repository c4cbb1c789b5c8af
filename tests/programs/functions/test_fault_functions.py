"""Faults as programs meet them; those that stop every motion at once are in test_motion_functions.py."""

from __future__ import annotations

import pytest

from roboglot.simulation.world.world import World
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("empty")


async def test_a_cliff_ahead_lets_no_walk_get_on(caller: Caller, world: World) -> None:
    world.faults.inject("cliff", "a")
    await caller.clock.advance(0.5)
    walked = await caller("cyberdog.motion.go_straight", 0.2, 1.0)
    assert (field(walked, "state.code"), field(walked, "response.code")) == (1, 3029)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("go_straight", (0.2, 0.5)),
        ("go_straight", (0.2, 0.0, 1.0)),
        ("trot_walking", (0.2, 0.0, 20.0, 0.03, 0.03, 0.5)),
        ("turn", (45.0,)),
    ],
)
async def test_a_robot_held_up_walks_nowhere(
    caller: Caller, world: World, name: str, values: tuple[float, ...]
) -> None:
    world.stage.lift("a")
    await caller.clock.advance(0.5)
    walked = await caller(f"cyberdog.motion.{name}", *values)
    assert (field(walked, "state.code"), field(walked, "response.code")) == (1, 3003)
    assert field(walked, "state.describe") == "the robot is held up: it has no floor under it"
    world.stage.let_go("a")
    await caller.clock.advance(1.0)
    assert field(await caller("cyberdog.motion.go_straight", 0.2, 0.2), "state.code") == 0


async def test_lidar_that_is_gone_has_no_new_scan(caller: Caller, world: World) -> None:
    await caller.clock.advance(0.5)
    assert field(await caller("cyberdog.lidar.get_data"), "ranges")
    world.faults.inject("lidar_gone", "a")
    await caller.clock.advance(1.5)
    begun = caller.clock.time()
    assert (await caller("cyberdog.lidar.get_data", 2)).fields == {}  # all defaults
    assert caller.clock.time() - begun > 1.9


async def test_battery_is_low_and_nothing_drives(caller: Caller, world: World) -> None:
    world.faults.inject("low_battery", "a", charge=0.08)
    world.faults.inject("emergency_stop", "a")
    await caller.clock.advance(0.5)
    data = await caller("cyberdog.bms.data")
    assert field(data, "batt_soc") == 8
    assert field(data, "power_motor_shutdown")


async def test_without_a_network(caller: Caller, world: World) -> None:
    await caller.clock.advance(3.0)
    assert field(await caller("cyberdog.network.data"), "is_connected")
    world.faults.inject("wifi_loss", "a")
    await caller.clock.advance(1.5)
    data = await caller("cyberdog.network.data")
    assert (field(data, "is_connected"), field(data, "ssid"), field(data, "robot_ip")) == (False, "", "")
