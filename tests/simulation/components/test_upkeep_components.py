"""Battery's guard and age, raw IMU values, the system's log and the developer's access."""

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.imu import Imu, ImuConverters
from roboglot.model.components.system.developer import Developer
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.components.system.system_log import SystemLog
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.components.energy.battery import NOMINAL


async def test_an_old_battery_holds_less(robot):
    state = robot[Battery].state
    assert state.health == pytest.approx(1 - 0.2 * state.cycles / 800)
    assert state.capacity == pytest.approx(100 / (6 * NOMINAL) * state.health)


@pytest.mark.slow  # minutes of robot time
@pytest.mark.world("empty")
async def test_time_left_follows_what_the_robot_does(robot, world, forward):
    world.stage.place("a", Pose(5, 5))
    await forward(seconds=60)
    idle = robot[Battery].state.remaining
    robot[Base].set_velocity(Twist(0.6, yaw=0.9))
    await forward(seconds=60)
    assert robot[Battery].state.remaining < 0.95 * idle
    before = robot[Battery].state
    robot[Base].set_velocity(Twist())
    await forward(seconds=200)
    used = before.percentage - robot[Battery].state.percentage
    assert used * idle == pytest.approx(before.percentage * 200, rel=0.15)


async def test_on_the_dock_no_time_runs_out(robot, forward):
    await forward(seconds=1)
    assert robot[Battery].state.charging
    assert robot[Battery].state.remaining is None


async def test_a_hot_battery_lets_nothing_in(robot, forward):
    await forward(seconds=1)
    robot[Battery].warm(52.0)
    await forward(seconds=1)
    state = robot[Battery].state
    assert (state.charge_locked, state.charging) == (True, False)
    robot[Battery].warm(44.0)
    await forward(seconds=1)
    assert robot[Battery].state.charging


async def test_almost_empty_it_beeps_until_something_feeds_it(robot, world, forward):
    world.stage.place("a", Pose(5, 5))
    robot[Battery].set_charge(0.04)
    await forward(seconds=1)
    assert robot[Battery].state.buzzing
    world.stage.plug_in("a")
    await forward(seconds=1)
    assert not robot[Battery].state.buzzing


async def test_raw_imu_values_are_the_reading_in_counts(robot, world, forward):
    for heading in (0.0, 90.0, 200.0):
        world.stage.place("a", Pose(5, 5, math.radians(heading)))
        await forward(seconds=0.5)
        raw, reading = robot[ImuConverters].raw, robot[Imu].reading
        assert raw.stamp == reading.stamp
        assert raw.acceleration[2] * raw.acceleration_unit == pytest.approx(
            reading.linear_acceleration.z, abs=raw.acceleration_unit
        )
        assert raw.rate[0] * raw.rate_unit == pytest.approx(reading.angular_velocity.x, abs=raw.rate_unit)
        x, y, z = (count * raw.field_unit for count in raw.field)
        north = math.degrees(math.atan2(y, x))  # robot frame; it lies along +y of the world
        assert math.remainder(north + heading - 90.0, 360.0) == pytest.approx(0.0, abs=5.0)
        assert z == pytest.approx(-43e-6, abs=3e-6)


async def test_the_log_goes_to_the_maker(robot, forward):
    await forward(seconds=2)
    robot[Health].set("test", True, "base", FaultLevel.WARNING, "for the log \ud83d")
    assert any("FaultRaised warning test: for the log" in line for line in robot[SystemLog].lines)
    upload = robot[SystemLog].upload()
    await forward(seconds=3)
    assert upload.status is ActionStatus.SUCCEEDED
    (taken,) = robot[SystemLog].uploads
    assert taken.size > 20


@pytest.mark.world("office", body="cyberdog2")
async def test_nothing_goes_out_without_the_internet(robot, world, forward):
    world.faults.inject("wifi_loss", "a")
    await forward(seconds=2)
    upload = robot[SystemLog].upload()
    await forward(seconds=3)
    assert isinstance(upload.error, Refused)
    assert robot[SystemLog].uploads == ()
    with pytest.raises(Refused):
        await robot[Developer].unlock(f"https://keys.example/{robot.description.serial}")


async def test_the_developers_access_opens_with_its_own_key(robot, forward):
    await forward(seconds=2)
    assert not robot[Developer].unlocked
    for link, error in (("keys", InvalidGoal), ("https://keys.example/other", NotFound), ("https://[", InvalidGoal)):
        with pytest.raises(error):
            await timed(robot[Developer].unlock(link), forward)
    await timed(robot[Developer].unlock(f"https://keys.example/{robot.description.serial}"), forward)
    assert robot[Developer].unlocked


async def timed(waiting, forward):
    """Let it wait while time passes."""
    import asyncio

    task = asyncio.ensure_future(waiting)
    await forward(seconds=1)
    return await task
