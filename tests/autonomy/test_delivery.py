"""The delivery service across crashes, and its pure rules."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from roboglot.autonomy.delivery.order_book import ENDED_MAX, OPEN_MAX
from roboglot.autonomy.delivery.rules import at_work
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.power import Power
from roboglot.model.components.logistics.delivery import (
    BoxChoice,
    Delivery,
    Order,
    OrderKind,
    OrderRequest,
    OrderStage,
    OrderStatus,
    Policy,
    WorkMode,
)
from roboglot.model.components.logistics.industry import (
    CallKind,
    Industry,
    Operation,
    RoundTemplate,
)
from roboglot.model.components.mapping.annotations import Line, LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.navigation import Tracks
from roboglot.model.components.system.firmware import Firmware, Module
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.storage.database import Database
from roboglot.testing import passed_in_order

THURSDAY = 1_767_225_600.0  # 2026-01-01T00:00Z
ROOM = PointOfInterest("r", Pose(2.0, 0.0), {"display_name": "room"})


@asynccontextmanager
async def running(file: Path) -> AsyncIterator[tuple[Robot, LockstepClock]]:
    clock, database = LockstepClock(), Database(file, in_place=True)
    fleet = build_fleet("empty", [RobotConfig()], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    try:
        yield fleet.robots["a"], clock
    finally:
        await fleet.close()
        database.close()


def crash(file: Path, image: Path) -> None:
    """Copy the database as kill -9 would leave it on the disk."""
    for part in file.parent.glob(f"{file.name}*"):
        shutil.copy(part, image.parent / part.name.replace(file.name, image.name))


def status_of(robot: Robot, order: Order) -> OrderStatus:
    return next(known.status for known in robot[Delivery].orders if known.id == order.id)


@pytest.mark.slow  # in short: test_it_holds_after_crash_while_people_load_it
async def test_orders_and_rules_survive_crash_and_go_on(tmp_path: Path) -> None:
    file, image = tmp_path / "robot.db", tmp_path / "crashed.db"
    policy = Policy(work_mode=WorkMode.MANUAL, hours=((0, 3600),), delivery_speed=0.8, words={"mode": 0})
    template = RoundTemplate("k", "supply", (Operation("room", "load", 5),))
    async with running(file) as (robot, clock):
        await robot[Places].put(ROOM)
        await robot[Delivery].change_policy(lambda _: policy)
        await robot[Industry].put_template(template)
        call = await robot[Industry].call(CallKind.BY_TEMPLATE, "room", template="k")
        requests = [OrderRequest(OrderKind.RETURN, "room"), OrderRequest(OrderKind.GUIDE, "r")]
        first, second = await robot[Delivery].accept(*requests)
        await clock.advance(3.0)
        assert status_of(robot, first) is OrderStatus.RUNNING
        crash(file, image)
    async with running(image) as (robot, clock):
        assert robot[Delivery].policy == policy
        assert robot[Industry].templates == (template,)
        assert robot[Industry].calls == (call,)
        await clock.advance(3.0)
        assert (status_of(robot, first), status_of(robot, second)) == (OrderStatus.RUNNING, OrderStatus.READY)
        await clock.advance(60.0)
        assert (status_of(robot, first), status_of(robot, second)) == (OrderStatus.SUCCEEDED, OrderStatus.SUCCEEDED)


async def test_it_holds_after_crash_while_people_load_it(tmp_path: Path) -> None:
    file, image = tmp_path / "robot.db", tmp_path / "crashed.db"
    async with running(file) as (robot, clock):
        await robot[Places].put(ROOM)
        await robot[Delivery].execute(False)
        (order,) = await robot[Delivery].accept(OrderRequest(OrderKind.RETURN, "room"))
        crash(file, image)
    async with running(image) as (robot, clock):
        await clock.advance(20.0)
        assert not robot[Delivery].executing
        assert status_of(robot, order) is OrderStatus.READY
        await robot[Delivery].cancel(order.number)
        assert status_of(robot, order) is OrderStatus.CANCELED


@pytest.mark.parametrize(
    "part", ["sleep", *(pytest.param(part, marks=pytest.mark.slow) for part in ("base", "reboot"))]
)
async def test_orders_wait_until_the_robot_is_awake(tmp_path: Path, part: str) -> None:
    async with running(tmp_path / "robot.db") as (robot, clock):
        await robot[Places].put(ROOM)
        match part:
            case "sleep":
                robot[Power].sleep()
            case "base":
                robot[Firmware].restart(Module.BASE)
            case "reboot":
                robot[Firmware].reboot()
        await clock.advance(2.0)
        (order,) = await robot[Delivery].accept(OrderRequest(OrderKind.RETURN, "room"))
        await clock.advance(0.5)
        assert status_of(robot, order) is OrderStatus.READY
        if part == "sleep":
            robot[Power].wake()
        await clock.advance(45.0 if part == "reboot" else 20.0)
        assert status_of(robot, order) is OrderStatus.SUCCEEDED


@pytest.mark.world("empty")
async def test_queues_are_bounded(robot: Robot) -> None:
    await robot[Places].put(ROOM)
    delivery = robot[Delivery]
    await delivery.execute(False)
    await delivery.accept(*[OrderRequest(OrderKind.RETURN, "room")] * OPEN_MAX)
    with pytest.raises(Refused, match="more than"):
        await delivery.accept(OrderRequest(OrderKind.RETURN, "room"))
    await delivery.cancel()
    await delivery.accept(*[OrderRequest(OrderKind.RETURN, "room")] * OPEN_MAX)
    await delivery.cancel()
    await delivery.accept(OrderRequest(OrderKind.RETURN, "room"))
    assert len(delivery.orders) <= ENDED_MAX + OPEN_MAX
    with pytest.raises(NotFound):
        await delivery.cancel("unknown")
    with pytest.raises(InvalidGoal):
        await delivery.accept(OrderRequest(OrderKind.RETURN, "room", stops=("room",) * 1000))
    with pytest.raises(NotFound):
        await delivery.accept(OrderRequest(OrderKind.TAKEOUT, "room", boxes=(BoxChoice("x", 0),)))
    for signal in (delivery.start_pickup, delivery.end_pickup, delivery.end_operation):
        with pytest.raises(Refused):
            await signal()


def test_working_hours() -> None:
    always = Policy()
    office = replace(always, hours=((8 * 3600, 18 * 3600),), rest_days=(0,))
    night = replace(always, hours=((22 * 3600, 6 * 3600),))
    hour = 3600.0
    assert at_work(always, THURSDAY)
    assert [at_work(office, THURSDAY + h * hour) for h in (7, 8, 17, 18)] == [False, True, True, False]
    assert [at_work(night, THURSDAY + h * hour) for h in (0, 5, 6, 12, 22)] == [True, True, False, False, True]
    sunday = THURSDAY + 3 * 24 * hour
    assert not at_work(office, sunday + 9 * hour)
    assert at_work(office, sunday + 33 * hour)


@pytest.mark.slow
@pytest.mark.world("empty", body="hermes")
async def test_a_round_passes_its_stops_in_turn(robot: Robot, world: World, clock: LockstepClock) -> None:
    spots = {"a": (1.5, 1.5), "b": (1.5, -1.0), "home desk": (2.5, 0.5)}
    for name, (x, y) in spots.items():
        await robot[Places].put(PointOfInterest(name, Pose(x, y), {"display_name": name}))
    await clock.advance(1.0)
    start, track = world.truth.pose_of("a"), [Pose()]
    tour = ("a", "b", "a", "a")
    (order,) = await robot[Delivery].accept(OrderRequest(OrderKind.RETURN, "home desk", stops=tour))
    for _ in range(900):
        await clock.advance(0.1)
        track.append(world.truth.pose_of("a").relative_to(start))
        (now,) = (known for known in robot[Delivery].orders if known.id == order.id)
        if now.status not in (OrderStatus.READY, OrderStatus.RUNNING):
            break
        if now.stage is OrderStage.AT_STOP:
            await robot[Delivery].end_operation()
    assert status_of(robot, order) is OrderStatus.SUCCEEDED
    goals = [Point(*spots[name]) for name in (*tour, "home desk")]
    assert passed_in_order(track, goals, 0.08) == len(goals)


@pytest.mark.world("empty")
async def test_orders_go_on_after_a_full_disk(robot: Robot, world: World, clock: LockstepClock) -> None:
    """The order under way stayed so for ever, and none began any more until the program was restarted."""
    await robot[Places].put(ROOM)
    requests = [OrderRequest(OrderKind.RETURN, "room"), OrderRequest(OrderKind.GUIDE, "room")]
    first, second = await robot[Delivery].accept(*requests)
    await clock.advance(3.0)
    (fault,) = world.faults.inject("full_disk", "a")
    await clock.advance(30.0)
    assert (status_of(robot, first), status_of(robot, second)) == (OrderStatus.RUNNING, OrderStatus.READY)
    world.faults.clear(fault.number)
    await clock.advance(30.0)
    assert status_of(robot, first).ended
    assert status_of(robot, second) is OrderStatus.SUCCEEDED


@pytest.mark.slow
@pytest.mark.world("empty")
@pytest.mark.parametrize(
    ("policy", "detour", "status"),
    [
        (Policy(tracks=Tracks.FREE, directed=True), False, OrderStatus.SUCCEEDED),
        (Policy(tracks=Tracks.STRICT), True, OrderStatus.SUCCEEDED),
        (Policy(tracks=Tracks.STRICT, directed=True), False, OrderStatus.FAILED),
    ],
)
async def test_orders_follow_tracks_as_policies_say(
    robot: Robot, clock: LockstepClock, policy: Policy, detour: bool, status: OrderStatus
) -> None:
    """The only track leads from the target's side to the robot's, in a bow."""
    corners = [Point(2, 0), Point(2, 1.2), Point(0.2, 1.2), Point(0.2, 0)]
    track = tuple(Line(0, LineKind.TRACK, start, end) for start, end in pairwise(corners))
    await robot[MapAnnotations].change(lambda annotations: replace(annotations, lines=track))
    await robot[Places].put(ROOM)
    await robot[Delivery].change_policy(lambda _: policy)
    await clock.advance(1.0)
    (order,) = await robot[Delivery].accept(OrderRequest(OrderKind.RETURN, "room"))
    highest = 0.0
    for _ in range(60):
        await clock.advance(0.5)
        highest = max(highest, robot[Localization].pose.y)
        if (now := status_of(robot, order)).ended:
            break
    assert (now, highest > 1.0) == (status, detour)
