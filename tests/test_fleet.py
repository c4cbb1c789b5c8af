"""A fleet that is closed leaves nothing under way: what still waited for robot time would keep its loop from ending."""

from __future__ import annotations

import asyncio
import json

import pytest

from roboglot.config import Config, RobotConfig, StartConfig
from roboglot.fleet import Fleet, build_fleet, origin_of
from roboglot.model.clock import LockstepClock
from roboglot.model.components.logistics.delivery import Delivery, OrderKind, OrderRequest
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.places import Places
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.storage.database import Database
from roboglot.testing import Forward

TURNS = 20  # of the loop


@pytest.mark.world("empty")
@pytest.mark.parametrize("seconds", [0.0, 0.1, 2.0])
async def test_deliveries_end_with_the_fleet(fleet: Fleet, robot: Robot, forward: Forward, seconds: float) -> None:
    before = asyncio.all_tasks()
    await robot[Places].put(PointOfInterest("r", Pose(2.0, 0.0), {"display_name": "room"}))
    await robot[Delivery].accept(*(OrderRequest(OrderKind.RETURN, "room") for _ in range(2)))
    await forward(seconds=seconds)
    assert asyncio.all_tasks() > before
    async with asyncio.timeout(60):
        await fleet.close()
        for _ in range(TURNS):
            await asyncio.sleep(0)
    assert asyncio.all_tasks() <= before


async def test_robots_start_where_configured_and_others_keep_away() -> None:
    database, wanted = Database(":memory:"), StartConfig(5.0, 5.0, 1.0)
    robots = [RobotConfig("a"), RobotConfig("b"), RobotConfig("c", start=wanted)]
    fleet = build_fleet("empty", robots, clock=LockstepClock(), seed=1, database=database)
    truth = fleet.world.truth
    assert truth.pose_of("c") == Pose(5.0, 5.0, 1.0)
    assert all(truth.pose_of(name).distance_to(truth.pose_of("c")) > 0.5 for name in "ab")
    outside = RobotConfig("a", start=StartConfig(1e6, 0.0))
    with pytest.raises(ValueError, match="has no place"):
        build_fleet("empty", [outside], clock=LockstepClock(), seed=1, database=database)
    await fleet.close()
    database.close()


async def test_a_robot_set_up_upstairs_knows_its_floor() -> None:
    """No map says so: no Slamware door is open."""
    database, upstairs = Database(":memory:"), StartConfig(13.5, 10.0, floor=1)
    robots = [RobotConfig("a", "hermes", start=upstairs), RobotConfig("b", "hermes")]
    fleet = build_fleet("office", robots, clock=LockstepClock(), seed=1, database=database)
    assert [robot[Floors].current for robot in fleet.robots.values()] == [1, 0]
    await fleet.close()
    database.close()


def test_a_recordings_settings_hold_no_secrets() -> None:
    config = Config(
        robots=(RobotConfig("a", "slamware://user:hunter2@10.0.0.7?token=hunter2"),),
        database="postgresql://robots:hunter2@db/robots",
        doors={"visual": {"cloud": "https://cloud", "cloud_token": "hunter2"}},
    )
    origin = origin_of(config, "1")
    kept = {attachment.name: attachment.data.decode() for attachment in origin.attachments}
    assert "hunter2" not in json.dumps(origin.facts) + kept["config.json"]
    assert json.loads(kept["config.json"])["database"] == "postgresql://db/robots"
