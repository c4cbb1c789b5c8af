"""The delivery robot, which has a lift radio, in the office, with a database that ends with it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.storage.database import Database


@asynccontextmanager
async def delivery_robot(clock: LockstepClock) -> AsyncIterator[Fleet]:
    """Yield it as robot ``a``, on its dock."""
    database = Database(":memory:")
    fleet = build_fleet("office", [RobotConfig(name="a", body="hermes")], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    yield fleet
    await fleet.close()
    database.close()
