"""A robot that is started again is where it was switched off, on the floor where it was, unless it was moved."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.config import RobotConfig, StartConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.settings import Settings
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.last_place import PLACE, last_place
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world import World
from roboglot.storage.database import Database
from roboglot.values import dataclass
from tests.narrowing import known
from tests.protocols.slamware.drawings import ok

SLAM, MULTI = "/api/core/slam/v1", "/api/multi-floor/map/v1"
OFFICE = Path(__file__).parents[4] / "examples" / "maps" / "office.stcm"  # in the world's frame
UPSTAIRS = StartConfig(x=12.0, y=10.0, yaw=0.0, floor=1)


@dataclass(frozen=True, slots=True)
class Run:
    """A robot from one start to the next."""

    robot: Robot
    world: World
    client: httpx.AsyncClient
    clock: LockstepClock

    @property
    def truth(self) -> Pose:
        return self.world.truth.pose_of("a")

    async def floor(self) -> str:
        return str((await self.client.get(f"{MULTI}/floors/:current")).json()["floor"])

    async def load(self, floor: str, pose: Pose) -> None:
        """Load the office's map, with the robot on a floor."""
        await ok(await self.client.post(f"{MULTI}/stcm", content=OFFICE.read_bytes()))
        await ok(await self.client.post(f"{MULTI}/stcm/:reload"))
        place: dict[str, Any] = {"x": pose.x, "y": pose.y, "yaw": pose.yaw}
        await ok(
            await self.client.put(
                f"{MULTI}/floors/:current", json={"building": "office", "floor": floor, "pose": place}
            )
        )
        await self.clock.advance(2.0)


@asynccontextmanager
async def running(database: Database, start: StartConfig | None) -> AsyncIterator[Run]:
    clock = LockstepClock()
    fleet = build_fleet("office", [RobotConfig(start=start)], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["a"]
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    await clock.advance(2.0)
    async with httpx.AsyncClient(base_url=door.endpoints[0].address, timeout=60, verify=False) as client:
        try:
            yield Run(robot, fleet.world, client, clock)
        finally:
            await door.close()
            await fleet.close()


@pytest.fixture
async def stored() -> AsyncIterator[Database]:
    """The data of a robot that was switched off upstairs, after it drove away from where it was put."""
    database = Database(":memory:")
    async with running(database, UPSTAIRS) as run:
        await run.load("first", Pose(12.0, 10.0))
        run.robot[Driving].move_by(Pose(1.5))
        await run.clock.advance(6.0)
        assert run.robot[Localization].pose.distance_to(run.truth) < 0.05
    yield database
    database.close()


async def test_robot_continues_at_its_place(stored: Database) -> None:
    async with running(stored, StartConfig(x=13.5, y=10.0, yaw=0.0, floor=1)) as run:
        assert await run.floor() == "first"
        assert run.robot[Floors].current == 1
        assert run.robot[Localization].lost is None
        assert run.robot[Localization].pose.distance_to(run.truth) < 0.05


@pytest.mark.slow
async def test_robot_in_the_car_is_on_its_floor() -> None:
    """The car has brought it there while it was off; the robot was switched off on the first floor."""
    database, in_the_car = Database(":memory:"), StartConfig(x=1.0, y=10.0, yaw=math.pi, floor=0)
    async with running(database, in_the_car) as run:
        await run.load("first", Pose(1.0, 10.0, math.pi))
    async with running(database, in_the_car) as run:
        assert await run.floor() == "ground"
        assert run.robot[Floors].current == 0
        assert run.robot[Localization].lost is None
        assert run.robot[Localization].pose.distance_to(run.truth) < 0.1
    database.close()


@pytest.mark.slow  # in short: test_robot_off_its_dock_is_before_it
async def test_robot_on_its_dock_is_on_start_floor(stored: Database) -> None:
    async with running(stored, None) as run:
        assert await run.floor() == "ground"
        assert run.robot[Localization].pose.distance_to(run.truth) < 0.05


async def test_robot_set_up_on_another_floor_finds_itself(stored: Database) -> None:
    """As after a ride by lift: the world puts it back at its start, and off every dock."""
    async with running(stored, StartConfig(x=12.0, y=14.0, yaw=0.0, floor=0)) as run:
        assert await run.floor() == "ground"
        assert run.robot[Floors].current == 0
        await run.clock.advance(5.0)
        assert run.robot[Localization].lost is None
        assert run.robot[Localization].pose.distance_to(run.truth) < 0.1


@pytest.mark.slow
async def test_lost_robot_keeps_its_last_place(stored: Database) -> None:
    async with running(stored, StartConfig(x=12.0, y=6.5, yaw=0.0, floor=0)) as run:
        assert run.robot[Localization].lost is not None
        kept = last_place(run.robot)
    async with running(stored, StartConfig(x=13.5, y=10.0, yaw=0.0, floor=1)) as run:
        assert last_place(run.robot) == kept  # a lost robot stores nothing
        assert run.robot[Localization].pose.distance_to(run.truth) < 0.05


async def test_robot_off_its_dock_is_before_it() -> None:
    database = Database(":memory:")
    async with running(database, None) as run:
        await run.load("ground", Pose(22.5, 8.935, 1.571))
    async with running(database, StartConfig(x=22.5, y=9.5, yaw=1.571, floor=0)) as run:
        assert known(last_place(run.robot)).docked
        assert run.robot[Localization].pose.distance_to(run.truth) < 0.05
    database.close()


@pytest.mark.slow  # in short: test_robot_continues_at_its_place
async def test_place_is_in_the_frame_of_the_file(stored: Database) -> None:
    at = StartConfig(x=13.5, y=10.0, yaw=0.0, floor=1)
    async with running(stored, at) as run:
        await ok(await run.client.put(f"{SLAM}/maps/origin", json={"new_origin": {"x": 10.0, "y": 5.0}}))
        run.robot[Driving].move_by(Pose(0.5))
        await run.clock.advance(11.0)
        assert run.robot[Localization].pose.x == pytest.approx(4.0, abs=0.1)
        assert known(last_place(run.robot)).pose.x == pytest.approx(14.0, abs=0.1)
        assert known(last_place(run.robot)).pose.y == pytest.approx(10.0, abs=0.1)


async def test_place_on_another_map_is_not_stored(stored: Database) -> None:
    async with running(stored, StartConfig(x=13.5, y=10.0, yaw=0.0, floor=1)) as run:
        before = last_place(run.robot)
        run.robot[Mapping].clear()  # by another door
        run.robot[Driving].move_by(Pose(1.0))
        await run.clock.advance(11.0)
        assert last_place(run.robot) == before


@pytest.mark.parametrize("value", [None, "nonsense", {"digest": 3}, {"digest": "", "floor": "", "pose": [1]}])
async def test_unreadable_place_is_left_out(bare: Robot, value: object) -> None:
    await bare[Settings].put(PLACE, value)
    assert last_place(bare) is None
