"""Callers of functions on a simulated robot."""

from __future__ import annotations

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Description, Robot
from tests.programs.functions.calling import Caller


@pytest.fixture
async def caller(robot: Robot, clock: LockstepClock) -> Caller:
    """A program's calls on the simulated robot."""
    return Caller(robot, clock)


@pytest.fixture
async def second_caller(robot: Robot, clock: LockstepClock) -> Caller:
    """Another program's calls on the same robot."""
    return Caller(robot, clock, "second")


@pytest.fixture
async def bare_caller(clock: LockstepClock) -> Caller:
    """A program's calls on a robot without parts."""
    plate = dict.fromkeys(("maker", "model", "serial", "hardware_version", "software_version"), "")
    return Caller(Robot("a", Description(**plate, radius=0.2, height=0.3), clock), clock)
