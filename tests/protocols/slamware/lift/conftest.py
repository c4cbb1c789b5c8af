"""The office with its lift, for one robot that can ride it."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from roboglot.fleet import Fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.geometry import Pose
from roboglot.simulation.world.world import World
from tests.autonomy.delivery_robot import delivery_robot


@pytest.fixture
async def fleet(clock: LockstepClock) -> AsyncIterator[Fleet]:
    """The delivery robot, which has a lift radio."""
    async with delivery_robot(clock) as fleet:
        yield fleet


@pytest.fixture
def origin(world: World) -> Pose:
    """Return the map's origin in the world: the robot's start."""
    return world.truth.pose_of("a")
