"""The drive: kinematics, accelerations, contact, slip."""

import math

import pytest

from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import BumperPressed, BumperReleased
from roboglot.model.geometry import STILL, Pose, Twist
from tests.masking import mask_bumper


async def test_drives_where_it_should(simulate):
    sim = simulate(start=Pose(5, 5, math.pi / 2))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5, 0.2, 0.0))
    await sim.clock.advance(2.0)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)
    # 2 s at speed; what acceleration loses, braking gains
    assert sim.pose.x == pytest.approx(5 - 0.4, abs=0.02)
    assert sim.pose.y == pytest.approx(5 + 1.0, abs=0.02)
    assert sim.pose.yaw == pytest.approx(math.pi / 2, abs=1e-6)


async def test_repeated_command_costs_nothing_once_robot_moves_so(simulate):
    sim = simulate(start=Pose(5, 5), compiled=False)
    base = sim.robot[Base]
    sim.world.start()
    base.set_velocity(Twist(yaw=1.0))
    await sim.clock.advance(1.0)
    assert not base.duty.on
    base.set_velocity(Twist(yaw=1.0))
    assert not base.duty.on
    for changed in (Twist(yaw=0.5), STILL):
        base.set_velocity(changed)
        assert base.duty.on
        await sim.clock.advance(1.0)
        assert base.velocity == changed
        assert not base.duty.on


async def test_kernel_ramps_as_the_base_does(simulate):
    async def speeds(*, compiled):
        sim = simulate(start=Pose(5, 5), compiled=compiled)
        base, seen = sim.robot[Base], []
        sim.world.start()
        for twist in (Twist(0.3, 0.2, 1.0), Twist(-0.2, 0.1, -2.0), Twist(0.1), STILL):
            base.set_velocity(twist)
            await sim.clock.advance(0.02)
            busy = base.duty.on
            seen.append((base.velocity, base.wheel_speeds))
            assert base.velocity != twist
            assert busy is not compiled
            for _ in range(20):
                await sim.clock.advance(0.02)
                seen.append((base.velocity, base.wheel_speeds))
            base.hindrances.limit(0.1, twist.speed)
            await sim.clock.advance(0.1)
            seen.append((base.velocity, base.wheel_speeds))
            base.hindrances.limit(math.inf, 0.0)
        return seen

    assert await speeds(compiled=True) == await speeds(compiled=False)


async def test_repeated_command_drives_on_after_a_cut(simulate):
    sim = simulate(start=Pose(5, 5))
    base = sim.robot[Base]
    sim.world.start()
    ahead = Twist(0.3, 0.0, 0.0)
    base.set_velocity(ahead)
    await sim.clock.advance(0.5)
    for stop in (base.cut, base.brake_hard, lambda: base.carry(ahead)):
        stop()
        base.set_velocity(ahead)
        await sim.clock.advance(0.5)
        assert base.velocity == ahead
    base.hindrances.touching = ((1.0, 0.0),)
    assert base.collides  # legs that carry a body would not


async def test_turns_on_the_spot(simulate):
    sim = simulate(start=Pose(5, 5))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(yaw=1.0))
    await sim.clock.advance(2.0)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)
    assert sim.pose.yaw == pytest.approx(2.0, abs=0.02)
    assert sim.pose.distance_to(Pose(5, 5)) < 0.001


async def test_accelerates_no_faster_than_it_can(simulate):
    sim = simulate(start=Pose(2, 5))
    base = sim.robot[Base]
    sim.world.start()
    base.set_velocity(Twist(9.0, 0.0, 99.0))
    speeds = []
    for _ in range(10):
        await sim.clock.advance(0.1)
        speeds.append(base.velocity.speed)
    assert speeds[:3] == pytest.approx([0.2, 0.4, 0.6])
    assert base.velocity == Twist(2.0, 0.0, 5.0)  # the limits


async def test_wheel_speeds_move_body_as_mecanum_wheels_do(simulate):
    sim = simulate(start=Pose(5, 5))
    base = sim.robot[Base]
    sim.world.start()
    base.set_wheel_speeds(WheelSpeeds(front_left=-8, front_right=8, rear_left=8, rear_right=-8))
    await sim.clock.advance(1.0)
    assert base.velocity.y == pytest.approx(0.4)
    assert base.velocity.x == pytest.approx(0.0)
    assert sim.pose.y > 5.25
    assert sim.pose.x == pytest.approx(5.0, abs=0.005)


async def test_wheel_speeds_of_velocity_give_that_velocity_back(simulate):
    sim = simulate(start=Pose(5, 5))
    base = sim.robot[Base]
    sim.world.start()
    base.set_velocity(Twist(0.3, -0.2, 0.5))
    await sim.clock.advance(1.0)
    wheels = base.wheel_speeds
    base.set_wheel_speeds(wheels)
    await sim.clock.advance(0.5)
    assert base.velocity.x == pytest.approx(0.3)
    assert base.velocity.y == pytest.approx(-0.2)
    assert base.velocity.yaw == pytest.approx(0.5)


async def test_wheel_speeds_beyond_limits_are_cut_in_proportion(simulate):
    sim = simulate(start=Pose(2, 5))
    base = sim.robot[Base]
    sim.world.start()
    base.set_wheel_speeds(WheelSpeeds(200.0, 200.0, 200.0, 200.0))
    await sim.clock.advance(2.0)
    assert base.velocity.x == pytest.approx(2.0)


@pytest.mark.parametrize("twist", [Twist(math.nan), Twist(0, math.inf), Twist(0, 0, -math.inf)])
async def test_refuses_what_is_no_number(simulate, twist):
    with pytest.raises(InvalidGoal):
        simulate(start=Pose(5, 5)).robot[Base].set_velocity(twist)


async def test_without_bumper_a_wall_stops_no_wheels(simulate):
    sim = simulate(start=Pose(9, 5))
    mask_bumper(sim.robot)
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(6.0)
    assert sim.pose.x == pytest.approx(9.75, abs=0.01)  # the wall is at 10, the hull's radius 0.25
    assert sim.robot[Odometry].reading.pose.x > 2.5  # slipping wheels keep counting


async def test_a_pressed_bumper_stops_the_wheels(simulate):
    sim = simulate(start=Pose(9, 5))
    events = sim.robot.events.subscribe(BumperPressed, BumperReleased)
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(6.0)
    assert sim.pose.x == pytest.approx(9.75, abs=0.01)  # the wall is at 10, the hull's radius 0.25
    assert sim.robot[Odometry].reading.pose.x < 0.8
    assert sim.robot[Bumper].pressed == {"front"}
    sim.robot[Base].set_velocity(Twist(-0.5))
    await sim.clock.advance(2.0)
    assert sim.pose.x < 9.2
    assert sim.robot[Bumper].pressed == frozenset()
    assert [(type(e), e.zone) for e in events.drain()] == [(BumperPressed, "front"), (BumperReleased, "front")]


@pytest.mark.parametrize(("twist", "zone"), [(Twist(y=0.5), "left"), (Twist(y=-0.5), "right"), (Twist(-0.5), "rear")])
async def test_bumper_reports_the_side(simulate, twist, zone):
    sim = simulate(start=Pose(9.5, 9.5, {"left": 0.0, "right": math.pi, "rear": math.pi}[zone]))
    sim.world.start()
    sim.robot[Base].set_velocity(twist)
    await sim.clock.advance(1.5)
    assert sim.robot[Bumper].pressed == {zone}


async def test_full_speed_into_wall_does_not_get_through(simulate):
    sim = simulate(start=Pose(2, 5))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(2.0))
    farthest = 0.0
    for _ in range(60):
        await sim.clock.advance(0.1)
        farthest = max(farthest, sim.pose.x)
    assert farthest < 9.765


async def test_robots_do_not_drive_through_each_other(simulate):
    sim = simulate(start=Pose(3, 5), robots=("a", "b"))
    sim.world.stage.place("b", Pose(5, 5))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(5.0)
    assert sim.pose.distance_to(sim.world.truth.pose_of("b")) > 0.49
