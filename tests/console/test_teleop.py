"""Driving by hand from a page: what a held pad does after a stop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from roboglot.console.settings import STALE
from roboglot.console.teleop import Pad, Velocity
from roboglot.console.verbs.robots import stop
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.errors import EmergencyStopped, Refused
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.testing import Forward

pytestmark = pytest.mark.world("empty")
NOW = 5000.0  # ms
Push = Callable[..., bool]


@pytest.fixture
def push(robot: Robot) -> Push:
    """Give a page's pad its next velocity, ``age`` s old."""
    pad, sent = Pad(robot, "page"), 0

    def give(x: float, age: float = 0.0) -> bool:
        nonlocal sent
        sent += 1
        return pad.drive(Velocity("a", sent, NOW - age * 1000.0, x), NOW)

    return give


async def hold(push: Push, forward: Forward) -> None:
    for _ in range(10):
        push(0.5)
        await forward(seconds=0.08)


def refused(push: Push) -> bool:
    with pytest.raises(Refused, match="let go"):
        push(0.5)
    return True


async def test_held_pad_drives_no_further_after_a_stop(robot: Robot, forward: Forward, push: Push) -> None:
    await hold(push, forward)
    assert robot[Base].velocity.speed > 0.1
    stopping = asyncio.create_task(stop(robot))
    await asyncio.sleep(0)
    while not stopping.done():
        assert refused(push)
        await forward(seconds=0.08)
    for _ in range(10):
        assert refused(push)
        await forward(seconds=0.08)
    assert robot[Base].velocity.speed < 0.02
    assert push(0.0)
    await hold(push, forward)
    assert robot[Base].velocity.speed > 0.1


async def test_held_pad_gives_way_to_a_newer_command(robot: Robot, forward: Forward, push: Push) -> None:
    await hold(push, forward)
    turning = robot[Driving].drive(Twist(yaw=0.5), source="test")
    await forward(seconds=0.5)
    assert refused(push)
    assert robot.actions.running() == [turning]


async def test_release_of_the_emergency_stop_moves_nothing(robot: Robot, forward: Forward, push: Push) -> None:
    await hold(push, forward)
    robot[EmergencyStop].engage()
    await forward(seconds=1.0)
    with pytest.raises((EmergencyStopped, Refused)):
        push(0.5)
    robot[EmergencyStop].release()
    await forward(seconds=1.0)
    assert refused(push)
    assert push(0.0)
    assert push(0.5)


async def test_pad_goes_on_after_a_silence(robot: Robot, forward: Forward, push: Push) -> None:
    """The link had a gap: nothing else took the robot."""
    await hold(push, forward)
    await forward(seconds=2.0)
    assert robot[Base].velocity.speed < 0.02
    await hold(push, forward)
    assert robot[Base].velocity.speed > 0.1


async def test_late_velocities_are_ignored_but_letting_go(robot: Robot, forward: Forward, push: Push) -> None:
    await hold(push, forward)
    (driving,) = robot.actions.running()
    assert not push(0.5, age=STALE + 0.1)
    assert push(0.0, age=STALE + 0.1)
    await forward(seconds=1.0)
    assert driving.reason == "the pad was let go"
