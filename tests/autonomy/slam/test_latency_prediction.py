"""Predicted pose of a late robot: commands that odometry could not know of yet are added."""

import math

import pytest

from roboglot.autonomy.navigation.latency_prediction import PosePredictor
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.geometry import ORIGIN, Pose, Twist
from roboglot.testing import assert_pose


class _Base(Base):
    """Late by ``delay``; moves nothing."""

    delay = 0.3

    def set_velocity(self, twist: Twist) -> None:
        raise NotImplementedError

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        raise NotImplementedError

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        raise NotImplementedError

    @property
    def velocity(self) -> Twist:
        raise NotImplementedError


@pytest.fixture
def base() -> _Base:
    return _Base()


async def test_commands_within_the_delay_are_added(base: Base, clock: LockstepClock) -> None:
    predictor = PosePredictor(base, clock)
    assert predictor.ahead(Pose(1.0)) == Pose(1.0)
    predictor.sent(Twist(x=1.0))
    await clock.advance(0.5)  # odometry already covers 0.2 s of it
    predictor.sent(Twist(yaw=math.pi))
    await clock.advance(0.1)
    assert_pose(predictor.ahead(ORIGIN), x=0.2, y=0.0, deg=18, within=1e-6)
    await clock.advance(0.3)
    assert_pose(predictor.ahead(Pose(yaw=0.5)), x=0.0, y=0.0, deg=math.degrees(0.5 + math.pi * 0.3), within=1e-6)


async def test_a_base_that_is_here_needs_none(clock: LockstepClock, base: _Base) -> None:
    base.delay = 0.0
    predictor = PosePredictor(base, clock)
    predictor.sent(Twist(x=1.0))
    await clock.advance(0.5)
    assert predictor.ahead(Pose(2.0)) == Pose(2.0)
