"""GET events: what happens to the robot, in the vendor's words, reported once."""

import asyncio
import contextlib

import httpx
import pytest

from roboglot.model.actions import Action
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.navigation import NavigationFeedback
from roboglot.model.components.system.firmware import Module
from roboglot.model.errors import Blocked, DockNotFound, RobotError, Unreachable
from roboglot.model.events import (
    BatteryChanged,
    BumperPressed,
    DockContactChanged,
    LocalizationRecovered,
    ModuleRestarted,
    PathBlocked,
    Rebooted,
    Rebooting,
    RecoveryMeans,
)
from roboglot.model.geometry import Path, Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.platform.event_log import EVENTS_MAX
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward

EVENTS = "/api/platform/v1/events"


async def read(client: httpx.AsyncClient) -> list[str]:
    return [event["type"] for event in (await client.get(EVENTS)).json()]


async def test_dock_charge_and_bumper(bare: Robot, bare_client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1.5)
    bare.events.publish(DockContactChanged(stamp=1.5, docked=True))
    bare.events.publish(BatteryChanged(stamp=1.5, percentage=0.5, charging=False))
    bare.events.publish(BatteryChanged(stamp=1.6, percentage=0.5, charging=True))
    bare.events.publish(BatteryChanged(stamp=1.7, percentage=0.51, charging=True))
    bare.events.publish(BatteryChanged(stamp=1.8, percentage=0.51, charging=False))
    bare.events.publish(DockContactChanged(stamp=1.9, docked=False))
    bare.events.publish(BumperPressed(stamp=2.0, zone="front"))
    events = (await bare_client.get(EVENTS)).json()
    assert events[0] == {"type": "ON_DOCK", "timestamp": "1500"}
    assert [event["type"] for event in events[1:]] == [
        "START_CHARGING",
        "STOP_CHARGING",
        "OFF_DOCK",
        "BUMPER_TRIGGERED",
    ]
    assert await read(bare_client) == []


@pytest.mark.parametrize(
    ("means", "later", "reset"),
    [(RecoveryMeans.GIVEN, 0.0, 1), (RecoveryMeans.GIVEN, 5.0, 0), (RecoveryMeans.NEARBY, 0.0, 0)],
)
async def test_lost_robot_pushed_onto_dock_is_reset(
    bare: Robot, bare_client: httpx.AsyncClient, forward: Forward, means: RecoveryMeans, later: float, reset: int
) -> None:
    await forward(seconds=1)
    bare.events.publish(DockContactChanged(stamp=1.0, docked=True))
    await forward(seconds=later)
    bare.events.publish(LocalizationRecovered(stamp=1.0 + later, means=means, pose=Pose(), seconds=3.0))
    assert (await read(bare_client)).count("RESET_MAP_TO_DOCK") == reset


async def test_unread_events_are_bounded(bare: Robot, bare_client: httpx.AsyncClient) -> None:
    for stamp in range(EVENTS_MAX + 10):
        bare.events.publish(BumperPressed(stamp=stamp, zone="front"))
    events = (await bare_client.get(EVENTS)).json()
    assert len(events) == EVENTS_MAX
    assert events[0]["timestamp"] == "10000"


async def test_time_and_events_begin_anew_at_a_restart(
    bare: Robot, bare_client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=100)
    assert (await bare_client.get("/api/platform/v1/timestamp")).json() == "100000"
    bare.events.publish(BumperPressed(stamp=99.0, zone="front"))
    bare.events.publish(Rebooting(stamp=100.0, seconds=30.0))
    await forward(seconds=30)
    bare.events.publish(BumperPressed(stamp=129.0, zone="rear"))
    bare.events.publish(Rebooted(stamp=130.0))
    await forward(seconds=2)
    bare.events.publish(BumperPressed(stamp=131.5, zone="left"))
    stamps: list[str] = []
    async with asyncio.timeout(60):
        while not stamps:  # the door opens again in real time
            with contextlib.suppress(httpx.ConnectError):
                stamps.append((await bare_client.get("/api/platform/v1/timestamp")).json())
    assert stamps == ["2000"]
    events = [(event["type"], event["timestamp"]) for event in (await bare_client.get(EVENTS)).json()]
    assert events == [("ROBOT_REBOOT", "0"), ("BUMPER_TRIGGERED", "1500")]
    bare.events.publish(ModuleRestarted(stamp=132.0, module=Module.SOFTWARE))
    assert (await bare_client.get("/api/platform/v1/timestamp")).json() == "2000"


async def test_imu_time_counts_from_the_base_start(client: httpx.AsyncClient, robot: Robot, forward: Forward) -> None:
    await forward(seconds=5)
    paths = [f"/api/core/{path}" for path in ("slam/v1/imu", "system/v1/rawimu", "system/v1/rawadcimu")]
    for path in paths:
        assert 4000 < (await client.get(path)).json()["timestamp"] <= 5000
    robot.events.publish(ModuleRestarted(stamp=robot.clock.time(), module=Module.BASE))
    await forward(seconds=1)
    for path in paths:
        assert 500 < (await client.get(path)).json()["timestamp"] <= 1000
    assert (await client.get("/api/platform/v1/timestamp")).json() == "6000"


async def test_history_can_be_kept(bare: Robot) -> None:
    door = SlamwareDoor(bare, "127.0.0.1", SlamwareConfig(port=0, keep_events=True))
    await door.start()
    bare.events.publish(BumperPressed(stamp=1, zone="front"))
    async with httpx.AsyncClient(base_url=door.endpoints[0].address, verify=False) as client:
        assert await read(client) == await read(client) == ["BUMPER_TRIGGERED"]
    await door.close()


async def test_blocked_for_long(
    bare: Robot, bare_client: httpx.AsyncClient, clock: LockstepClock, forward: Forward
) -> None:
    async def go(action: Action) -> None:
        action.report(NavigationFeedback(stage="waiting", remaining=Path(), milestones=(), time_to_goal=1.0))
        bare.events.publish(PathBlocked(stamp=clock.time(), action=action))
        await clock.sleep(500)
        action.report(NavigationFeedback(stage="driving", remaining=Path(), milestones=(), time_to_goal=1.0))
        bare.events.publish(PathBlocked(stamp=clock.time(), action=action))
        action.report(NavigationFeedback(stage="turning", remaining=Path(), milestones=(), time_to_goal=1.0))
        await clock.sleep(500)

    bare.actions.start("navigate", go, resources={BASE})
    await forward(seconds=179)
    assert await read(bare_client) == ["PATH_OCCUPIED"]
    await forward(seconds=2)
    assert await read(bare_client) == ["ROBOT_BLOCKED"]
    await forward(seconds=800)
    assert await read(bare_client) == ["PATH_OCCUPIED"]  # this time it went on at once


@pytest.mark.parametrize(
    ("error", "word"),
    [
        (DockNotFound("gone"), "SEARCH_DOCK_FAILED"),
        (Unreachable("wall"), "MOVE_TO_LANDING_POINT_FAILED"),
        (Blocked("chair"), "MOVE_TO_LANDING_POINT_FAILED"),
    ],
)
async def test_a_failed_way_home(
    bare: Robot, bare_client: httpx.AsyncClient, forward: Forward, error: RobotError, word: str
) -> None:
    async def fail(_: Action) -> None:
        raise error

    bare.actions.start("dock", fail, resources={BASE})
    bare.actions.start("navigate", fail, resources=())
    await forward(seconds=0)
    assert await read(bare_client) == [word]
