"""cyberdog.bms, odometer, imu, lidar: what programs read is what the robot's parts say."""

from __future__ import annotations

import math

import pytest
from calling import Caller, field

from roboglot.model.components.battery import Battery
from roboglot.model.components.lidar import Lidar
from roboglot.model.components.odometry import Odometry
from roboglot.model.errors import ComponentMissing
from roboglot.model.sensing import BatteryState
from roboglot.programs.functions.results import RECORDS

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


async def test_the_charging_battery(bare_caller: Caller) -> None:
    bare_caller.robot.add(Battery, OnTheCharger())
    data = await bare_caller("cyberdog.bms.data")
    bits = [field(data, name) for name in ("batt_st", "power_wired_charging", "power_finished_charging")]
    assert bits == [2, True, False]
    OnTheCharger.charge = 1.0
    data = await bare_caller("cyberdog.bms.data")
    bits = [field(data, name) for name in ("batt_st", "power_wired_charging", "power_finished_charging")]
    assert bits == [4, False, True]


class OnTheCharger(Battery):
    charge = 0.5

    @property
    def state(self) -> BatteryState:
        return BatteryState(self.charge, 25.0, 2.0, 25.0, True, 7)


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
    assert len(field(scan, "ranges")) == len(caller.robot[Lidar].scan.ranges)  # type: ignore[union-attr]
    last = field(scan, "angle_min") + field(scan, "angle_increment") * (len(field(scan, "ranges")) - 1)
    assert field(scan, "angle_max") == pytest.approx(last)
    assert field(scan, "scan_time") == pytest.approx(0.1)


async def test_results_have_no_fields_that_their_types_lack(caller: Caller) -> None:
    def check(value: object) -> None:
        if hasattr(value, "fields"):
            assert set(value.fields) <= set(RECORDS[value.type].fields), value  # type: ignore[attr-defined]
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


async def test_a_missing_sensor_fails_in_state_and_raises_for_data(bare_caller: Caller) -> None:
    for sensor in ("bms", "odometer", "imu", "lidar"):
        assert field(await bare_caller(f"cyberdog.{sensor}.state"), "code") == 1
        with pytest.raises(ComponentMissing):
            await bare_caller(f"cyberdog.{sensor}.data")
        with pytest.raises(ComponentMissing):
            await bare_caller(f"cyberdog.{sensor}.get_data")
