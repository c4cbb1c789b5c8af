"""1100 and 1101 through the real channel, before the flight of the world ``stairs``."""

from __future__ import annotations

import asyncio
import math

import pytest

from roboglot.autonomy.stairs import alignment
from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.stair_alignment import ALIGN_WITH_STAIRS
from roboglot.model.geometry import Pose, Twist
from roboglot.testing import assert_pose
from tests.protocols.cyberdog.phone import answered

pytestmark = pytest.mark.world("stairs", body="cyberdog2")
BEFORE_THE_STEP = Pose(3.3, 4.0, 0.2)
FOOT, BEFORE = 4.0, 0.55  # m


@pytest.fixture(autouse=True)
async def unheard(app):
    """No app connects: robot time runs ahead of its answers, and a lost one would end the action under test."""
    app.silent = True


@pytest.fixture
async def stands(robot, world, forward):
    """A dog that stands before the flight."""
    world.stage.place("a", BEFORE_THE_STEP)
    await forward(seconds=0.5)


def aligning(robot):
    return next((action for action in robot.actions.running(BASE) if action.name == ALIGN_WITH_STAIRS), None)


async def begun(client, robot, forward, up=True):
    assert await answered(client, 1100, {"data": up}, forward) == {"success": True}
    action = aligning(robot)
    assert action
    return action


async def test_up_it_aligns_after_the_answer(stands, client, robot, world, forward) -> None:
    action = await begun(client, robot, forward)
    await forward(seconds=10)
    assert action.status is ActionStatus.SUCCEEDED
    assert_pose(world.truth.pose_of("a"), x=FOOT - BEFORE, deg=0, within=0.03, within_deg=3)


@pytest.mark.slow  # in short: test_it_ends_square_before_the_first_step
async def test_down_it_looks_for_the_landings_edge(client, robot, world, forward) -> None:
    world.stage.place("a", Pose(5.55, 4.0, math.pi - 0.2))
    await forward(seconds=0.5)
    assert await client.ask(1100, {"data": True}) == {"success": False}  # there are no stairs
    action = await begun(client, robot, forward, up=False)
    await forward(seconds=10)
    assert action.status is ActionStatus.SUCCEEDED
    assert_pose(world.truth.pose_of("a"), x=4.9 + BEFORE, deg=180, within=0.03, within_deg=3)


async def test_missing_step_is_reported_and_disturbs_no_one(client, robot, world, forward) -> None:
    world.stage.place("a", Pose(2.0, 2.0))
    await forward(seconds=0.5)
    driving = robot[Driving].drive(Twist(yaw=0.1))
    for up in (True, False):
        assert await client.ask(1100, {"data": up}) == {"success": False}
    assert robot.actions.running(BASE) == [driving]


@pytest.mark.parametrize("params", [{}, {"data": 1}, {"data": "true"}, {"enable": True}])
async def test_data_is_needed_as_a_truth_value(stands, client, robot, params) -> None:
    assert await client.ask(1100, params) == {"error_code": 323}
    assert not aligning(robot)


async def test_it_is_stopped_midway(stands, client, robot, world, forward) -> None:
    action = await begun(client, robot, forward)
    await forward(seconds=0.4)
    assert await answered(client, 1101, {}, forward) == {"success": True}
    assert action.status is ActionStatus.CANCELED
    here = world.truth.pose_of("a")
    await forward(seconds=1)
    assert world.truth.pose_of("a").distance_to(here) < 0.002
    assert await client.ask(1101) == {"success": True}  # it is standing already


@pytest.mark.slow  # in short: test_it_is_stopped_midway
async def test_other_motions_take_over(stands, client, robot, forward) -> None:
    frame = {"motion_id": 303, "cmd_type": 1, "vel_des": [-0.1, 0.0, 0.0]}
    sit = {"motion_id": 143, "duration": 0}
    for code, params in ((1002, frame), (1004, sit)):
        action = await begun(client, robot, forward)
        await answered(client, code, params, forward)
        await forward(seconds=0.5)
        assert action.status is ActionStatus.CANCELED, code
    assert await answered(client, 1100, {"data": True}, forward) == {"success": True}  # from sitting it gets up first


async def test_a_figure_is_not_broken_off_for_it(stands, client, robot, passing) -> None:
    dancing = asyncio.ensure_future(client.ask(1004, {"motion_id": 123}))
    await passing(lambda: robot[Legs].performing)
    assert await client.ask(1100, {"data": True}) == {"success": False}
    assert robot[Legs].performing
    dancing.cancel()
    await asyncio.gather(dancing, return_exceptions=True)


async def test_the_emergency_stop_ends_it(stands, client, robot, forward) -> None:
    action = await begun(client, robot, forward)
    await answered(client, 1004, {"motion_id": 0}, forward)
    await forward(seconds=0.2)
    assert action.status is ActionStatus.CANCELED
    assert await client.ask(1100, {"data": True}) == {"success": False}


async def test_an_empty_battery_refuses_it(stands, client, robot, forward) -> None:
    robot[Battery].set_charge(0.04)
    await forward(seconds=1)
    assert await client.ask(1100, {"data": True}) == {"success": False}


@pytest.mark.slow  # in short: test_it_is_stopped_midway
async def test_it_stops_when_the_app_is_lost(
    stands, client, app, door, robot, world, passing, forward, monkeypatch
) -> None:
    monkeypatch.setattr(alignment, "ALIGN_MAX", 600.0)
    action = await begun(client, robot, forward)
    world.stage.lift("a", 0.0)  # held back, it never arrives
    app.silent = False
    await client.ask(10001)
    await passing(lambda: door._context.app.connected)
    assert not action.status.ended
    app.silent = True
    await passing(lambda: not door._context.app.connected)
    await passing(lambda: action.status.ended)
    assert action.status is ActionStatus.CANCELED
    assert action.reason == "the app is lost"


@pytest.mark.world("empty", body="robomaster_ep")
async def test_body_that_sees_no_ground_lacks_the_service(client) -> None:
    assert await client.ask(1100, {"data": True}) == {"error_code": 322}
    assert await client.ask(1101) == {"error_code": 322}
