"""cyberdog.touch, network, tof, ultrasonic, gps: what programs read is what the world does to the robot."""

from __future__ import annotations

import math

import pytest

from roboglot.model.components.sensing.gps import Gps
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.components.system.network import Network
from roboglot.model.errors import ComponentMissing
from roboglot.model.geometry import Pose
from roboglot.simulation.world.world import World
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("empty", body="cyberdog2")


async def test_touches_are_waited_for(caller: Caller, world: World) -> None:
    waiting = caller.start("cyberdog.touch.get_data", 5)
    await caller.clock.advance(1.0)
    assert not waiting.done()
    world.stage.touch("a", TouchKind.LONG)
    await caller.clock.advance(0.2)
    assert field(waiting.result(), "touch_state") == 3
    world.stage.touch("a", TouchKind.DOUBLE)
    await caller.clock.advance(0.2)
    data = await caller("cyberdog.touch.data")
    assert field(data, "touch_state") == 2
    assert field(data, "header.stamp.sec") == pytest.approx(caller.clock.epoch(), abs=2)


async def test_without_a_touch_the_last_one_comes_back(caller: Caller) -> None:
    start = caller.clock.time()
    assert (await caller("cyberdog.touch.get_data", 2)).fields == {}
    assert caller.clock.time() - start == pytest.approx(2.0, abs=0.1)


async def test_the_radio(caller: Caller) -> None:
    data = await caller("cyberdog.network.data")
    assert field(data, "is_connected") is caller.robot[Network].connected is True
    assert field(data, "strength") == min(100, round(2 * (caller.robot[Network].signal + 100)))
    card = caller.robot[Network].state
    assert card.ssid
    assert card.address
    names = ("ssid", "robot_ip", "provider_ip", "is_internet")
    assert [field(data, name) for name in names] == [card.ssid, card.address, card.gateway, True]
    await caller.robot[Network].switch_off()
    await caller.clock.advance(1.0)
    data = await caller("cyberdog.network.data")
    assert [field(data, name) for name in ("is_connected", *names)] == [False, "", "", "", False]


async def test_tof_sees_what_stands_before_the_head(caller: Caller, world: World) -> None:
    free = await caller("cyberdog.tof.get_data")
    assert field(free, "rear.right_rear.tof_position") == 3
    assert field(free, "head.left_head.data_available") is True
    pose = world.truth.pose_of("a")
    before = Pose(pose.x + 0.55 * math.cos(pose.yaw), pose.y + 0.55 * math.sin(pose.yaw))
    world.stage.add_obstacle(before, (0.1, 0.8, 0.6))
    await caller.clock.advance(0.3)
    data = await caller("cyberdog.tof.data")
    left = field(data, "head.left_head.data")
    assert len(left) == 64
    assert max(left) <= 0.66 + 1e-6
    assert 0.15 < min(left[:16]) < 0.4 < min(field(free, "head.left_head.data")[:8])


async def test_ultrasonic_measures_while_the_program_runs(caller: Caller, world: World) -> None:
    sensors = caller.robot[RangeSensors]
    assert not sensors.measuring
    pose = world.truth.pose_of("a")
    world.stage.add_obstacle(
        Pose(pose.x + 1.5 * math.cos(pose.yaw), pose.y + 1.5 * math.sin(pose.yaw)), (0.2, 1.0, 1.0)
    )
    data = await caller("cyberdog.ultrasonic.get_data")
    reading = sensors.reading("ultrasonic")
    assert reading
    assert field(data, "range") == reading.distance
    assert 0.9 < reading.distance < 1.5
    assert (field(data, "min_range"), field(data, "max_range")) == (reading.range_min, reading.range_max)
    caller.session.cancel("the end")
    assert not sensors.measuring


@pytest.mark.world("yard", body="cyberdog2")
async def test_gps_under_the_open_sky(caller: Caller) -> None:
    await caller.clock.advance(30.0)
    asked = caller.clock.epoch()
    data = await caller("cyberdog.gps.get_data")
    reading = caller.robot[Gps].reading
    assert (field(data, "lat"), field(data, "lon")) == (reading.latitude, reading.longitude)
    assert field(data, "lat") == pytest.approx(39.904, abs=0.01)
    assert (field(data, "fix_type") >= 2, field(data, "num_sv") > 3) == (True, True)
    stamp = field(data, "sec") + field(data, "nanosec") * 1e-9
    assert stamp > asked - 1e-6
    assert field(data, "itow") == pytest.approx((stamp - 315964800 + 18) % 604800 * 1000, abs=1)


async def test_indoors_there_is_no_fix(caller: Caller) -> None:
    await caller.clock.advance(25.0)
    assert field(await caller("cyberdog.gps.data"), "fix_type") == 0


async def test_groups_without_their_part_fail(bare_caller: Caller) -> None:
    for group in ("touch", "network", "tof", "ultrasonic", "gps"):
        state = await bare_caller(f"cyberdog.{group}.state")
        assert (field(state, "code"), field(state, "describe")) == (1, f"this robot has no {group}")
        with pytest.raises(ComponentMissing):
            await bare_caller(f"cyberdog.{group}.data")


async def test_the_whole_is_well_when_all_parts_are(caller: Caller) -> None:
    await caller.clock.advance(2.0)
    assert field(await caller("cyberdog.state"), "describe") == "success"
