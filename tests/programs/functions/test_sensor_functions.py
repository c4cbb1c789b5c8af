"""cyberdog.bms, odometer, imu, lidar: what programs read is what the robot's parts say."""

from __future__ import annotations

import math

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import ComponentMissing
from roboglot.model.sensing import BatteryState, Supply
from roboglot.programs.functions.records import RECORDS
from roboglot.programs.worker.values import Record
from tests.narrowing import known
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("empty")


async def test_the_battery_in_the_vendors_units(caller: Caller) -> None:
    await caller("cyberdog.motion.go_straight", 0.4, 1.0)  # off the dock
    state = caller.robot[Battery].state
    data = await caller("cyberdog.bms.get_data")
    assert field(data, "batt_soc") == round(state.percentage * 100)
    assert field(data, "batt_volt") == pytest.approx(state.voltage * 1000, abs=1)
    assert field(data, "batt_curr") < 0
    assert (field(data, "batt_st"), field(data, "power_normal"), field(data, "power_wired_charging")) == (
        1,
        True,
        False,
    )
    assert field(data, "power_expower_supply") is False
    assert field(await caller("cyberdog.bms.data"), "batt_soc") == field(data, "batt_soc")


CHARGING = [
    "batt_st",
    "power_normal",
    "power_wired_charging",
    "power_finished_charging",
    "power_wp_place",
    "power_wp_charging",
    "power_expower_supply",
]


@pytest.mark.parametrize(
    ("charge", "charging", "supply", "expected"),
    [
        (0.5, True, Supply.WIRE, [2, False, True, False, False, False, True]),
        (0.5, True, Supply.WIRELESS, [2, False, False, False, True, True, True]),
        (0.5, True, Supply.CONTACTS, [2, False, False, False, True, True, True]),
        (1.0, True, Supply.WIRE, [4, False, False, True, False, False, True]),
        (0.98, False, Supply.WIRELESS, [4, False, False, True, True, False, True]),
        (0.98, False, Supply.NONE, [1, True, False, False, False, False, False]),
    ],
)
async def test_charging(
    bare_caller: Caller, charge: float, charging: bool, supply: Supply, expected: list[object]
) -> None:
    bare_caller.robot.add(Battery, Charged(BatteryState(charge, 25.0, 2.0, 25.0, charging, 7, supply)))
    data = await bare_caller("cyberdog.bms.data")
    assert [field(data, name) for name in CHARGING] == expected


class Charged(Battery):
    def __init__(self, state: BatteryState) -> None:
        self._state = state

    @property
    def state(self) -> BatteryState:
        return self._state


@pytest.mark.parametrize(
    ("state", "expected"),
    [
        (BatteryState(0.5, 25.0, -1.0, 25.0, False, 7, health=0.934), [93, 0, 0, 0, 0]),
        (BatteryState(0.04, 25.0, -1.0, 25.0, False, 7, buzzing=True), [100, 0, 1, 0, 0]),
        (BatteryState(0.5, 25.0, 0.0, 55.0, False, 7, Supply.WIRELESS, charge_locked=True), [100, 1, 0, 3, 3]),
        (BatteryState(0.5, 25.0, 2.0, 25.0, True, 7, Supply.WIRE), [100, 0, 0, 1, 1]),
        (BatteryState(1.0, 25.0, 2.0, 25.0, True, 7, Supply.CONTACTS), [100, 0, 0, 2, 2]),
    ],
)
async def test_the_batterys_guard(bare_caller: Caller, state: BatteryState, expected: list[int]) -> None:
    bare_caller.robot.add(Battery, Charged(state))
    data = await bare_caller("cyberdog.bms.data")
    names = ("batt_health", "disable_charge", "buzze", "power_supply", "status")
    assert [field(data, name) for name in names] == expected


async def test_a_sleeping_robot_has_its_motors_off(caller: Caller) -> None:
    names = ("batt_st", "power_motor_shutdown", "power_soft_shutdown", "key_val")
    data = await caller("cyberdog.bms.data")
    assert [field(data, name) for name in names][1:] == [False, False, 0]
    caller.robot[Legs].go_limp()
    assert field(await caller("cyberdog.bms.data"), "power_motor_shutdown")
    caller.robot[Power].sleep()
    await caller.clock.advance(10.0)
    data = await caller("cyberdog.bms.data")
    assert field(data, "batt_st") & 0b11000 == 0b01000
    assert [field(data, name) for name in names][1:] == [True, False, 0]
    caller.robot[Power].shut_down()
    await caller.clock.advance(1.0)
    data = await caller("cyberdog.bms.data")
    assert field(data, "batt_st") & 0b11000 == 0b11000
    assert [field(data, name) for name in names][1:] == [True, True, 1]


async def test_odometry_follows_the_robot(caller: Caller) -> None:
    await caller("cyberdog.motion.turn", 90)
    await caller("cyberdog.motion.go_straight", 0.4, 0.5)
    data = await caller("cyberdog.odometer.get_data")
    pose = caller.robot[Odometry].reading.pose
    assert field(data, "pose.pose.position.y") == pytest.approx(pose.y, abs=0.01)
    assert 2 * math.atan2(*(field(data, f"pose.pose.orientation.{axis}") for axis in "zw")) == pytest.approx(
        pose.yaw, abs=0.01
    )
    assert (field(data, "header.frame_id"), field(data, "child_frame_id")) == ("odom", "base_link")


async def test_new_data_is_younger_than_the_call(caller: Caller) -> None:
    await caller.clock.advance(1.0)
    for sensor in ("odometer", "imu", "lidar"):
        asked = caller.clock.epoch()
        data = await caller(f"cyberdog.{sensor}.get_data")
        stamp = field(data, "header.stamp.sec") + field(data, "header.stamp.nanosec") * 1e-9
        assert stamp > asked - 1e-6, sensor
        assert field(await caller(f"cyberdog.{sensor}.state"), "code") == 0


async def test_the_imu_feels_gravity(caller: Caller) -> None:
    await caller.clock.advance(0.5)
    assert field(await caller("cyberdog.imu.data"), "linear_acceleration.z") == pytest.approx(9.81, abs=0.5)


async def test_a_scan_is_whole(caller: Caller) -> None:
    scan = await caller("cyberdog.lidar.get_data", 2)
    assert len(field(scan, "ranges")) == len(known(caller.robot[Lidar].scan).ranges)
    last = field(scan, "angle_min") + field(scan, "angle_increment") * (len(field(scan, "ranges")) - 1)
    assert field(scan, "angle_max") == pytest.approx(last)
    assert field(scan, "scan_time") == pytest.approx(0.1)


async def test_results_have_no_fields_that_their_types_lack(caller: Caller) -> None:
    def check(value: object) -> None:
        if isinstance(value, Record):
            assert set(value.fields) <= set(RECORDS[value.type].fields), value
            for inner in value.fields.values():
                check(inner)

    for name in (
        "bms.data",
        "odometer.data",
        "imu.data",
        "lidar.get_data",
        "motion.params",
        "motion.turn",
        "bms.state",
    ):
        check(await caller(f"cyberdog.{name}"))


async def test_missing_sensor_fails_in_state_and_raises_data(bare_caller: Caller) -> None:
    for sensor in ("bms", "odometer", "imu", "lidar"):
        assert field(await bare_caller(f"cyberdog.{sensor}.state"), "code") == 1
        with pytest.raises(ComponentMissing):
            await bare_caller(f"cyberdog.{sensor}.data")
        with pytest.raises(ComponentMissing):
            await bare_caller(f"cyberdog.{sensor}.get_data")
