"""Driving on an arithmetic base: what the commands become, how moves end, who gives way."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.autonomy.navigation.driving import OdometryDriving
from roboglot.autonomy.navigation.speed_profile import cruise_speed, trapezoid_time
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base, BaseLimits, WheelSpeeds
from roboglot.model.components.motion.driving import BASE, MOVE_MAX, Driving
from roboglot.model.components.motion.legs import LEGS, Legs, Posture
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Blocked, EmergencyStopped, InvalidGoal
from roboglot.model.geometry import STILL, Pose, Twist, wrap_angle
from roboglot.model.robot import Description, Robot
from roboglot.model.sensing import OdometryReading
from roboglot.testing import Forward

STEP = 0.004


class Cart(Base, Odometry):
    """Follows its commands with limited acceleration, exactly, unless it stands before a wall."""

    limits = BaseLimits(twist=Twist(1.0, 1.0, 2.0), linear_acceleration=1.5, angular_acceleration=4.0)

    def __init__(self, clock: LockstepClock) -> None:
        self._clock = clock
        self.pose = Pose()
        self.twist = STILL
        self.goal = STILL
        self.wheels = WheelSpeeds()
        self.wall_x = math.inf
        self.commands: list[tuple[float, Twist]] = []
        clock.call_later(STEP, self._step)

    def set_velocity(self, twist: Twist) -> None:
        self.goal = twist.clamped(self.limits.twist)
        self.commands.append((self._clock.time(), twist))

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        self.wheels = speeds
        self.set_velocity(Twist(x=0.05 * speeds.front_left))

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        return self.wheels

    @property
    def velocity(self) -> Twist:
        return self.twist

    @property
    def reading(self) -> OdometryReading:
        return OdometryReading(self._clock.time(), self.pose, self.twist, 0.0)

    def _step(self) -> None:
        linear, angular = self.limits.linear_acceleration * STEP, self.limits.angular_acceleration * STEP

        def towards(now: float, goal: float, by: float) -> float:
            return now + max(-by, min(by, goal - now))

        self.twist = Twist(
            towards(self.twist.x, self.goal.x, linear),
            towards(self.twist.y, self.goal.y, linear),
            towards(self.twist.yaw, self.goal.yaw, angular),
        )
        moved = self.pose.compose(Pose(self.twist.x * STEP, self.twist.y * STEP, self.twist.yaw * STEP))
        self.pose = Pose(min(moved.x, self.wall_x), moved.y, moved.yaw)
        self._clock.call_later(STEP, self._step)


class SlowLegs(Legs):
    """Stands up within two seconds."""

    def __init__(self, robot: Robot, posture: Posture) -> None:
        self._robot = robot
        self._posture = posture

    @property
    def posture(self) -> Posture:
        return self._posture

    @property
    def body_height(self) -> float:
        return 0.2

    def stand(self, *, source: str = "") -> Action:
        async def rise(_: Action) -> None:
            self._posture = Posture.CHANGING
            await self._robot.clock.sleep(2.0)
            self._posture = Posture.STANDING

        return self._robot.actions.start("stand", rise, resources={BASE, LEGS}, source=source)


SlowLegs.__abstractmethods__ = frozenset()  # other abilities of legs do not matter here


def slow_legs(robot: Robot, posture: Posture) -> SlowLegs:
    legs = SlowLegs(robot, posture)  # type: ignore[abstract]
    robot.add(Legs, legs)
    return legs


@pytest.fixture
def clock() -> LockstepClock:
    return LockstepClock()


@pytest.fixture
async def cart(clock: LockstepClock) -> Cart:
    return Cart(clock)


@pytest.fixture
async def carted(clock: LockstepClock, cart: Cart) -> Robot:
    """A robot on the arithmetic base, with driving."""
    plate = Description(
        maker="m", model="m", serial="s", hardware_version="1", software_version="1", radius=0.25, height=0.3
    )
    robot = Robot("a", plate, clock)
    robot.add(Base, cart)
    robot.add(Odometry, cart)
    robot.add(Driving, OdometryDriving(robot))
    return robot


async def test_velocity_holds_for_its_lifetime_then_base_stands(
    carted: Robot, cart: Cart, clock: LockstepClock
) -> None:
    action = carted[Driving].drive(Twist(x=0.5), lifetime=1.0, source="test")
    await clock.advance(0.9)
    assert cart.twist == Twist(x=0.5)
    await clock.advance(0.6)
    assert action.status is ActionStatus.SUCCEEDED
    assert cart.twist.speed < 0.01


async def test_command_during_the_braking_of_another_expires_too(robot: Robot, forward: Forward) -> None:
    robot[Driving].drive(Twist(x=0.5), lifetime=1.0, source="test")
    await forward(seconds=1.1)
    assert robot[Base].velocity.x > 0.1  # it brakes
    second = robot[Driving].drive(Twist(x=0.5), lifetime=0.4, source="test")
    await forward(seconds=3)
    assert second.status is ActionStatus.SUCCEEDED
    assert robot[Base].velocity.speed < 0.01


async def test_new_command_of_one_source_continues_without_gap(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    first = carted[Driving].drive(Twist(x=0.5), lifetime=0.5, source="test")
    for _ in range(10):
        await clock.advance(0.4)
        assert carted[Driving].drive(Twist(x=0.5), lifetime=0.5, source="test") is first
    assert cart.pose.x == pytest.approx(0.5 * 4.0, abs=0.1)
    assert all(command == Twist(x=0.5) for _, command in cart.commands)
    await clock.advance(1.5)
    assert first.status is ActionStatus.SUCCEEDED


async def test_another_source_takes_over_after_base_has_braked(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    first = carted[Driving].drive(Twist(x=1.0), source="one")
    await clock.advance(1.5)
    second = carted[Driving].drive(Twist(x=-1.0), source="two")
    await clock.advance(0.1)
    assert (first.status, second.status) == (ActionStatus.CANCELING, ActionStatus.ACCEPTED)
    await clock.advance(3.0)
    assert (first.status, second.status) == (ActionStatus.CANCELED, ActionStatus.EXECUTING)
    assert cart.twist.x == -1.0


async def test_cancel_by_source_brakes(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    action = carted[Driving].drive(Twist(x=1.0), source="one")
    await clock.advance(1.5)
    action.cancel()
    await clock.advance(1.0)
    assert action.status is ActionStatus.CANCELED
    assert cart.twist.speed < 0.01


async def test_paused_drive_stands_and_ends_with_its_lifetime(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    action = carted[Driving].drive(Twist(x=1.0), lifetime=5.0)
    await clock.advance(1.0)
    action.pause()
    await clock.advance(1.5)
    assert cart.twist.speed == 0.0
    action.resume()
    await clock.advance(1.5)
    assert cart.twist.x == 1.0
    action.pause()
    await clock.advance(2.0)
    assert action.status is ActionStatus.SUCCEEDED


async def test_wheel_speeds_reach_the_base(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    carted[Driving].drive(WheelSpeeds(1.0, 2.0, 3.0, 4.0))
    await clock.advance(0.1)
    assert cart.wheels == WheelSpeeds(1.0, 2.0, 3.0, 4.0)


@pytest.mark.parametrize(
    "offset",
    [
        Pose(1.0, 0.0, 0.0),
        Pose(-0.3, 0.4, 0.0),
        Pose(0.0, 0.0, math.pi / 2),
        Pose(0.0, 0.0, -5 * math.pi),
        Pose(1.0, -0.5, math.pi),
        Pose(0.02, 0.0, 0.0),
        Pose(0.0, 0.0, 0.0),
    ],
)
async def test_a_move_ends_standing_on_its_goal(carted: Robot, cart: Cart, clock: LockstepClock, offset: Pose) -> None:
    cart.pose = Pose(2.0, 1.0, 2.5)
    goal = cart.pose.compose(offset)
    turned, last = 0.0, cart.pose.yaw
    action = carted[Driving].move_by(offset)
    while not action.status.ended:
        await clock.advance(0.02)
        turned, last = turned + wrap_angle(cart.pose.yaw - last), cart.pose.yaw
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert cart.pose.distance_to(goal) < 0.01
    assert turned == pytest.approx(offset.yaw, abs=math.radians(1.0))
    assert cart.twist.speed < 0.01


async def test_move_takes_the_time_that_its_speed_says(carted: Robot, clock: LockstepClock) -> None:
    action = carted[Driving].move_by(Pose(x=1.0), speed=0.25)
    await action_end(clock, action)
    assert 4.0 < action.ended_at - action.started_at < 5.2


async def test_translation_and_rotation_end_together(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    carted[Driving].move_by(Pose(2.0, 0.0, math.pi / 2), speed=0.5)
    await clock.advance(2.2)
    assert cart.pose.x == pytest.approx(1.0, abs=0.15)
    assert cart.pose.yaw == pytest.approx(math.pi / 4, abs=0.1)


async def test_a_move_against_a_wall_gives_up(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    cart.wall_x = 0.5
    action = carted[Driving].move_by(Pose(x=2.0))
    await clock.advance(6.0)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, Blocked)
    assert cart.goal == Twist()


async def test_a_paused_move_holds_and_goes_on(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    action = carted[Driving].move_by(Pose(x=2.0))
    await clock.advance(1.0)
    action.pause()
    await clock.advance(5.0)
    held = cart.pose
    await clock.advance(5.0)
    assert cart.pose == held
    action.resume()
    await clock.advance(4.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert cart.pose.x == pytest.approx(2.0, abs=0.01)


async def test_emergency_stop_lasts_until_someone_says_stand_up(carted: Robot, clock: LockstepClock) -> None:
    legs = slow_legs(carted, Posture.LIMP)
    for _ in range(3):  # a joystick keeps sending
        with pytest.raises(EmergencyStopped):
            carted[Driving].drive(Twist(x=0.5))
    with pytest.raises(EmergencyStopped):
        carted[Driving].move_by(Pose(x=0.5))
    legs.stand()
    await clock.advance(3.0)
    assert carted[Driving].drive(Twist(x=0.5)).status is ActionStatus.ACCEPTED


async def test_a_lying_robot_stands_up_first(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    slow_legs(carted, Posture.LYING)
    action = carted[Driving].move_by(Pose(x=0.5), source="door")
    await clock.advance(1.9)
    assert action.status is ActionStatus.ACCEPTED
    assert cart.pose == Pose()
    await clock.advance(4.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert cart.pose.x == pytest.approx(0.5, abs=0.01)


async def test_robot_that_cannot_stand_up_does_not_drive(carted: Robot, cart: Cart, clock: LockstepClock) -> None:
    slow_legs(carted, Posture.LYING)
    action = carted[Driving].drive(Twist(x=0.5), source="door")
    await clock.advance(1.0)
    carted.actions.running("legs")[0].cancel()
    await clock.advance(1.0)
    assert action.status is ActionStatus.ABORTED
    assert cart.pose == Pose()


async def test_nonsense_is_refused_before_anything_moves(carted: Robot) -> None:
    driving = carted[Driving]
    for offset in (Pose(x=math.nan), Pose(x=math.inf), Pose(yaw=math.nan), Pose(x=MOVE_MAX * 2)):
        with pytest.raises(InvalidGoal):
            driving.move_by(offset)
    for speed in (0.0, -1.0, math.nan):
        with pytest.raises(InvalidGoal):
            driving.move_by(Pose(x=1.0), speed=speed)
    for command in (Twist(x=math.nan), WheelSpeeds(front_left=math.inf)):
        with pytest.raises(InvalidGoal):
            driving.drive(command)
    with pytest.raises(InvalidGoal):
        driving.drive(Twist(), lifetime=math.nan)
    assert not carted.actions.running()


@settings(max_examples=50)
@given(distance=st.floats(0.01, 50), speed=st.floats(0.05, 3), acceleration=st.floats(0.1, 5), slack=st.floats(1, 4))
def test_the_cruise_speed_takes_the_time_asked_for(
    distance: float, speed: float, acceleration: float, slack: float
) -> None:
    duration = trapezoid_time(distance, speed, acceleration) * slack
    cruise = cruise_speed(distance, duration, acceleration)
    assert cruise <= speed * (1 + 1e-6) or distance < speed * speed / acceleration
    assert trapezoid_time(distance, cruise, acceleration) == pytest.approx(duration, rel=1e-4)


async def action_end(clock: LockstepClock, action: Action) -> None:
    """Let time pass until it has ended, a minute at most."""
    for _ in range(600):
        if action.status.ended:
            return
        await clock.advance(0.1)
