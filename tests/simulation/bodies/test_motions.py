"""Motions in the world: where the robot is afterwards, how high it flew, what they need, what stops them."""

from __future__ import annotations

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import (
    BodyPose,
    Legs,
    Posture,
    Step,
)
from roboglot.model.components.motion.motions import MOTIONS, Motion
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Blocked, InvalidGoal, Refused
from roboglot.model.geometry import STILL, Orientation, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.files import BODIES
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

FIELD = 'name = "field"\n[[floors]]\nsize = [60, 60]\nenclosed = false\n'
MOVING = [m for m, spec in MOTIONS.items() if (spec.jumps or spec.way != Pose()) and spec.before == {Posture.STANDING}]


@pytest.fixture
def dog(simulate):
    sim = simulate(start=Pose(5, 5), body="cyberdog2")
    sim.world.start()
    return sim


@pytest.mark.slow  # one each: tests/protocols/cyberdog/motion/test_figures.py
async def test_all_jumps_and_walks_end_where_table_says(tmp_path):
    """Run all at once, a robot for each, side by side in an open field, without costly sensors."""
    text = (BODIES / "cyberdog2.toml").read_text()
    simple = text[: text.index("[imu]")] + text[text.index("[battery]") : text.index("[dock_contact]")]
    (tmp_path / "dog.toml").write_text(simple)
    (tmp_path / "field.toml").write_text(FIELD)
    clock = LockstepClock()
    starts = [Pose(5 + 6 * (i % 9), 5 + 6 * (i // 9), 0.7 * i) for i in range(len(MOVING))]
    placements = [RobotPlacement(f"r{i}", str(tmp_path / "dog.toml"), start) for i, start in enumerate(starts)]
    world = World(load_world(str(tmp_path / "field.toml")), placements, clock=clock)
    robots = [Robot(f"r{i}", world.description_of(f"r{i}"), clock) for i in range(len(MOVING))]
    for robot in robots:
        world.equip(robot)
    world.start()
    actions = [robot[Legs].perform(motion) for robot, motion in zip(robots, MOVING, strict=True)]
    peaks = [0.0] * len(MOVING)
    while not all(action.status.ended for action in actions):
        await clock.advance(0.1)
        for i in range(len(MOVING)):
            peaks[i] = max(peaks[i], world._physics.hulls[f"r{i}"].rise)
    await clock.advance(0.5)
    for i, (motion, action) in enumerate(zip(MOVING, actions, strict=True)):
        spec, gone = MOTIONS[motion], world.truth.pose_of(f"r{i}").relative_to(starts[i])
        assert action.status is ActionStatus.SUCCEEDED, motion
        assert action.ended_at - action.started_at == pytest.approx(spec.duration, abs=0.2), motion
        assert (gone.x, gone.y) == pytest.approx((spec.way.x, spec.way.y), abs=0.02), motion
        assert math.remainder(gone.yaw - spec.way.yaw, math.tau) == pytest.approx(0.0, abs=0.02), motion
        assert peaks[i] == pytest.approx(spec.peak, abs=0.05), motion
        assert robots[i][Legs].posture is Posture.STANDING
    world.close()


async def test_a_jump_is_felt_and_counted(dog):
    imu, falls = dog.robot[Imu], []
    dog.robot[Legs].perform(Motion.JUMP_FORWARD_60)
    for _ in range(140):
        await dog.clock.advance(0.02)
        falls.append(imu.reading.linear_acceleration.z)
    assert min(falls) < 2.0  # weightless
    assert max(falls) > 25.0  # pushing off, landing
    assert dog.pose.x == pytest.approx(5.6, abs=0.02)
    assert dog.robot[Odometry].reading.pose.x == pytest.approx(0.6, abs=0.08)


async def test_a_wall_in_the_way_stops_a_jump(dog):
    dog.world.stage.place("a", Pose(9.5, 5.0))
    await dog.clock.advance(0.1)
    action = dog.robot[Legs].perform(Motion.JUMP_FORWARD_60)
    await dog.clock.advance(5.0)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, Blocked)
    assert dog.pose.x < 9.78
    assert dog.robot[Legs].posture is Posture.STANDING
    assert dog.robot[Legs].body_height == pytest.approx(0.22, abs=0.005)
    dog.robot[Base].set_velocity(Twist(-0.3))


async def test_given_up_in_air_it_lands_and_stands(dog):
    hull = dog.world._physics.hulls["a"]
    action = dog.robot[Legs].perform(Motion.BACK_FLIP)
    while hull.rise < 0.2:
        await dog.clock.advance(0.02)
    action.cancel()
    await dog.clock.advance(2.0)
    assert action.status is ActionStatus.CANCELED
    assert hull.rise == pytest.approx(0.0, abs=0.005)
    assert dog.robot[Legs].posture is Posture.STANDING
    assert dog.robot[Legs].attitude.pitch == pytest.approx(0.0, abs=1e-6)


async def test_sitting_comes_before_what_is_done_sitting(dog):
    legs = dog.robot[Legs]
    refused = legs.perform(Motion.WAG)
    await dog.clock.advance(0.1)
    assert isinstance(refused.error, Refused)
    sitting = legs.perform(Motion.SIT_DOWN)
    assert legs.performing is None
    await dog.clock.advance(1.0)
    assert legs.performing is Motion.SIT_DOWN
    await dog.clock.advance(15.0)
    assert sitting.status is ActionStatus.SUCCEEDED
    assert legs.posture is Posture.SITTING
    assert legs.attitude.pitch == pytest.approx(-0.6)
    with pytest.raises(Refused):
        dog.robot[Base].set_velocity(Twist(0.1))
    wag = legs.perform(Motion.WAG)
    await dog.clock.advance(16.0)
    assert (wag.status, legs.posture) == (ActionStatus.SUCCEEDED, Posture.SITTING)
    flip = legs.perform(Motion.BACK_FLIP)
    await dog.clock.advance(0.1)
    assert isinstance(flip.error, Refused)
    legs.stand()
    await dog.clock.advance(2.0)
    assert (legs.posture, legs.attitude.pitch) == (Posture.STANDING, 0.0)


@pytest.mark.parametrize("why", ["battery", "wire", "held", "hot", "lying"])
async def test_refused(dog, why):
    legs = dog.robot[Legs]
    match why:
        case "battery":
            dog.robot[Battery].set_charge(0.2)
        case "wire":
            dog.world.stage.plug_in("a")
        case "held":
            dog.world.stage.lift("a")
        case "hot":
            dog.robot[Motors].warm(90.0)
        case "lying":
            legs.lie_down()
    await dog.clock.advance(2.0)
    action = legs.perform(Motion.BOW)
    await dog.clock.advance(0.1)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, Refused)
    if why == "battery":
        getting_up = legs.perform(Motion.GET_UP)
        await dog.clock.advance(6.0)
        assert getting_up.status is ActionStatus.SUCCEEDED


async def test_new_motion_replaces_the_running_one(dog):
    legs = dog.robot[Legs]
    bow = legs.perform(Motion.BOW)
    await dog.clock.advance(2.0)
    legs.perform(Motion.JUMP_UP_30)
    await dog.clock.advance(4.0)
    assert bow.status is ActionStatus.CANCELED


async def test_on_its_side_it_gets_up(dog):
    dog.world.stage.roll_over("a", math.pi / 2)
    await dog.clock.advance(0.1)
    assert dog.robot[Imu].reading.orientation.roll == pytest.approx(math.pi / 2, abs=0.05)
    action = dog.robot[Legs].perform(Motion.GET_UP)
    await dog.clock.advance(0.5)
    assert abs(dog.robot[Imu].reading.orientation.roll) > 0.5  # on its way
    await dog.clock.advance(5.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert dog.robot[Imu].reading.orientation.roll == pytest.approx(0.0, abs=0.05)


async def test_limp_legs_end_a_motion_at_once(dog):
    legs = dog.robot[Legs]
    action = legs.perform(Motion.DANCE_1)
    await dog.clock.advance(5.0)
    legs.go_limp()
    await dog.clock.advance(0.2)
    assert action.status is ActionStatus.CANCELED
    assert legs.posture is Posture.LIMP
    await dog.clock.advance(1.0)
    assert legs.body_height < 0.08
    getting_up = legs.perform(Motion.GET_UP_FAST)
    await dog.clock.advance(6.0)
    assert (getting_up.status, legs.posture) == (ActionStatus.SUCCEEDED, Posture.STANDING)


async def test_own_choreography(dog):
    legs = dog.robot[Legs]
    down = BodyPose(height=0.14)
    action = legs.dance([Step(1.0, body=down), Step(1.0, Twist(0.3), BodyPose(attitude=Orientation(yaw=0.2)))])
    await dog.clock.advance(1.0)
    assert legs.body_height == pytest.approx(0.14, abs=0.01)
    await dog.clock.advance(3.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert dog.pose.x == pytest.approx(5.3, abs=0.02)
    assert legs.body_height == pytest.approx(0.22, abs=0.005)
    with pytest.raises(InvalidGoal):
        legs.dance([Step(1.0, body=BodyPose(height=0.9))])
    with pytest.raises(InvalidGoal):
        legs.dance([Step(1.0, Twist(9.0))])
    with pytest.raises(InvalidGoal):
        legs.dance([Step(0.1)] * 1001)


async def test_no_one_drives_while_it_performs(dog):
    dog.robot[Legs].perform(Motion.DANCE_1)
    await dog.clock.advance(3.0)
    with pytest.raises(Refused):
        dog.robot[Base].set_velocity(Twist(0.2))
    assert dog.robot[Base].velocity == STILL


async def test_up_a_stair_and_down_again(tmp_path):
    (tmp_path / "step.toml").write_text(
        'name = "step"\n[[floors]]\nsize = [10, 10]\n'
        "terrain = [{ at = [5.0, 5.0], profile = [[0.0, 0.12], [3.0, 0.12]], width = 4.0 }]\n"
    )
    clock = LockstepClock()
    placement = RobotPlacement("a", "cyberdog2", start=Pose(4.7, 5.0))
    world = World(load_world(str(tmp_path / "step.toml")), [placement], clock=clock)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    world.start()
    hull = world._physics.hulls["a"]
    up = robot[Legs].perform(Motion.JUMP_STAIR)
    await clock.advance(6.0)
    assert up.status is ActionStatus.SUCCEEDED
    assert hull.rise == pytest.approx(0.12, abs=0.005)
    assert robot[Imu].reading.orientation.pitch == pytest.approx(0.0, abs=0.02)
    turned = robot[Legs].perform(Motion.JUMP_LEFT_TURN)
    await clock.advance(2.0)
    assert turned.status is ActionStatus.SUCCEEDED
    world.stage.place("a", Pose(5.22, 5.0, math.pi))
    robot[Legs].perform(Motion.JUMP_DOWN_STAIR)
    await clock.advance(6.0)
    assert hull.rise == pytest.approx(0.0, abs=0.005)
    assert hull.pose.x == pytest.approx(4.77, abs=0.02)
    world.close()
