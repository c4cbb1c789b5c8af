"""A robot maps two floors itself, merges them, and rides between them; both have a dock."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from roboglot.cli.maps.merge import merged
from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.logistics.lift_client import LiftClient, LiftDoor
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.storage.database import Database
from roboglot.testing import Forward
from tests.protocols.slamware.drawings import ok
from tests.protocols.slamware.lift.two_floors import ACTIONS, AREAS, LIFT, MULTI, SUCCESS, finish, start

SLAM, TOWER = "/api/core/slam/v1", Path(__file__).parents[1] / "data" / "tower.toml"
HELD = 120.0  # s
DOCK_ABOVE = Pose(8.605, 4.4, 3.1416)  # of a docked robot, in the world


@pytest.fixture
async def fleet(clock: LockstepClock, tmp_path: Path) -> AsyncIterator[Fleet]:
    """The tower with a dock on its upper floor, too."""
    world = tmp_path / "tower.toml"
    world.write_text(f"{TOWER.read_text()}\ndocks = [{{ at = [8.88, 4.4], facing = 180 }}]\n")
    database = Database(":memory:")
    built = build_fleet(str(world), [RobotConfig(name="a", body="hermes")], clock=clock, seed=1, database=database)
    await built.start(wait=True)
    yield built
    await built.close()
    database.close()


class Surveyor:
    """Client that maps floors; ``origin`` is the map's in the world."""

    def __init__(self, client: httpx.AsyncClient, forward: Forward, origin: Pose) -> None:
        self.client, self.forward, self.origin = client, forward, origin

    def seen(self, x: float, y: float) -> dict[str, float]:
        point = Pose(x, y).relative_to(self.origin).point
        return {"x": point.x, "y": point.y}

    async def do(self, name: str, **options: object) -> None:
        id = await start(self.client, name, **options)
        assert (await finish(self.client, self.forward, id, within=500))[0] == SUCCESS, name

    async def survey(self, place: str, *spots: tuple[float, float]) -> bytes:
        """Drive to the spots, draw the elevator and a place at the last one, and return the map."""
        for spot in spots:
            await self.do("MoveToAction", target=self.seen(*spot))
        car = {"start": self.seen(1.75, 3.0), "end": self.seen(0.15, 3.0), "half_width": 0.8}
        await ok(await self.client.post(AREAS, json={"area": car, "metadata": {"elevator_id": LIFT}}))
        mark = {"id": place, "pose": self.seen(*spots[-1]) | {"yaw": 0.0}, "metadata": {"display_name": place}}
        await ok(await self.client.post("/api/core/artifact/v1/pois", json=mark))
        return (await self.client.get(f"{SLAM}/maps/stcm")).content


async def ride_up(robot: Robot, one: Surveyor, world: World) -> None:
    """Enter the car as a building's control has it come, and ride without a map of the upper floor."""
    lift = robot[LiftClient]
    lift.hold_door(HELD)
    await one.forward(seconds=5)
    await one.do("EnterElevatorAction", elevator_id=LIFT)
    lift.close_door()
    lift.call(1)
    for _ in range(60):
        await one.forward(seconds=1)
        if world.truth.floor_of("a") == 1 and lift.state.door is LiftDoor.OPEN:
            break
    lift.hold_door(HELD)


@pytest.mark.slow  # a long story; test_home_is_on_start_or_bound_floor has its end
async def test_two_floors_are_mapped_merged_and_ridden(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, tmp_path: Path
) -> None:
    await forward(seconds=2)
    one = Surveyor(client, forward, world.truth.pose_of("a"))
    below = await one.survey("below", (6, 2), (6, 5), (3.5, 3))
    await ride_up(robot, one, world)
    await ok(await client.delete(f"{SLAM}/maps"))
    one.origin = world.truth.pose_of("a")
    for old in (AREAS, "/api/core/artifact/v1/pois", f"{SLAM}/homedocks"):
        await ok(await client.delete(old))
    dock = DOCK_ABOVE.relative_to(one.origin)
    entry = {"id": "above", "pose": {"x": dock.x, "y": dock.y, "yaw": dock.yaw}, "metadata": {"display_name": "above"}}
    await ok(await client.post(f"{SLAM}/homedocks", json=entry))
    above = await one.survey("above", (3.2, 3), (6, 4.4), (6, 1.5), (6, 4))
    for name, data in (("below", below), ("above", above)):
        (tmp_path / f"{name}.stcm").write_bytes(data)
    tower = merged([f"ground={tmp_path}/below.stcm", f"first={tmp_path}/above.stcm"], "T", lambda _: b"")
    await ok(await client.post(f"{MULTI}/stcm", content=tower))
    pose = (await client.get(f"{SLAM}/localization/pose")).json()
    await ok(await client.post(f"{MULTI}/stcm/:reload", json={"pose": pose}))
    await ok(await client.put(f"{MULTI}/floors/:current", json={"building": "T", "floor": "first", "pose": pose}))

    await one.do("MultiFloorMoveAction", target={"poi_name": "below"})
    assert world.truth.floor_of("a") == 0
    assert world.truth.pose_of("a").distance_to(Point(3.5, 3.0)) < 0.15
    await one.do("MultiFloorMoveAction", target={"poi_name": "above"})
    assert world.truth.floor_of("a") == 1
    assert world.truth.pose_of("a").distance_to(Point(6.0, 4.0)) < 0.15
    await one.do("MultiFloorBackHomeAction")  # past the dock on this floor
    assert (world.truth.floor_of("a"), robot[DockContact].docked) == (0, True)
    assert (await client.get(f"{ACTIONS}/:current")).status_code == 404
