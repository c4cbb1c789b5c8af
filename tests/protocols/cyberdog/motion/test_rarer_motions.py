"""Motions that few apps ask for: walks that look ahead, poses by the servo, one foot, what a program danced, states."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.feet import Foot, Footfall
from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import (
    BodyPose,
    Legs,
    Posture,
    Step,
)
from roboglot.model.geometry import Orientation, Pose, Twist
from roboglot.protocols.cyberdog.chapters.motion.motion_start import MotionRequest
from roboglot.protocols.cyberdog.chapters.motion.reasons import reason
from roboglot.wire.cyberdog.chapters.motion.motion import MotionCode
from tests.protocols.cyberdog.phone import App, Client, answered, until

pytestmark = pytest.mark.world("playground", body="cyberdog2")
Passing = Callable[[Callable[[], object]], Awaitable[None]]
TROT = [
    Footfall(0.2, frozenset(pair)) for pair in ((Foot.LEFT_FRONT, Foot.RIGHT_REAR), (Foot.RIGHT_FRONT, Foot.LEFT_REAR))
]


@pytest.fixture(autouse=True)
async def middle(world, robot, forward):
    """The robot stands where there is room, some time after its start."""
    world.stage.place("a", Pose(3.0, 6.2, 0.0))
    await forward(seconds=0.5)


async def frames(client: Client, forward, count: int, **fields: Any) -> None:
    for _ in range(count):
        await client.ask(1002, {"cmd_type": 1, **fields})
        await forward(seconds=0.1)


async def test_frames_hold_the_body_at_a_pose(client, robot, world, forward) -> None:
    before = world.truth.pose_of("a")
    await frames(client, forward, 6, motion_id=201, rpy_des=[0.0, 0.2, 0.1], pos_des=[0.0, 0.0, 0.25])
    attitude = robot[Legs].attitude
    assert (attitude.pitch, attitude.yaw) == (pytest.approx(0.2, abs=0.01), pytest.approx(0.1, abs=0.01))
    assert robot[Legs].body_height == pytest.approx(0.25, abs=0.01)
    assert world.truth.pose_of("a").distance_to(before) < 0.02
    assert not robot.actions.running(BASE)


async def test_frames_add_to_the_body_pose_within_limits(client, app: App, robot, forward, passing) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    rolled = []
    for _ in range(3):
        await client.ask(1002, {"motion_id": 202, "rpy_des": [0.05, 0, 0]})
        await forward(seconds=0.3)
        rolled.append(robot[Legs].attitude.roll)
    assert rolled == [pytest.approx(0.05, abs=0.01), pytest.approx(0.10, abs=0.01), pytest.approx(0.15, abs=0.01)]
    for _ in range(12):
        await client.ask(1002, {"motion_id": 202, "rpy_des": [0.05, 0, 0]})
        await forward(seconds=0.3)
    assert robot[Legs].attitude.roll == pytest.approx(robot[Legs].limits.angle, abs=0.01)
    await until(lambda: app.of(1003))
    assert {push["code"] for push in app.of(1003)} == {0}
    await client.ask(1002, {"motion_id": 201, "rpy_des": [0, 2.0, 0]})
    await until(lambda: app.of(1003)[-1]["code"] == 3010)
    await client.ask(1002, {"motion_id": 201})
    await until(lambda: app.of(1003)[-1]["code"] == 0)
    await client.ask(1002, {"motion_id": 202, "rpy_des": [0, 99.0, 0]})
    await until(lambda: app.of(1003)[-1]["code"] == 3010)
    await client.ask(1002, {"motion_id": 203, "rpy_des": [0, 0.1, 0]})  # takes a duration: not a servo motion
    await until(lambda: app.of(1003)[-1]["code"] == 3008)


@pytest.mark.parametrize(("number", "gait"), [(390, Gait.RUN), (391, Gait.TROT_MEDIUM), (392, Gait.TROT_MEDIUM)])
async def test_registered_gaits_walk(client, robot, world, forward, number: int, gait: Gait) -> None:
    before = world.truth.pose_of("a")
    walk = {"motion_id": number, "vel_des": [0.6, 0, 0]}
    assert (await client.ask(1004, walk))["code"] == 3010  # the duration is missing
    asking = asyncio.ensure_future(client.ask(1004, {**walk, "duration": 1500}))
    await until(lambda: robot.actions.running())
    await forward(seconds=1)
    assert robot[Legs].gait is gait
    assert (await client.ask(10001))["motion_status"]["motion_id"] == number
    await forward(seconds=2)
    assert (await asking)["code"] == 0
    assert 0.6 < world.truth.pose_of("a").relative_to(before).x < 1.1


async def test_a_foot_is_held_out(client, robot, forward) -> None:
    params = {"motion_id": 213, "contact": 0b1110, "rpy_des": [0.1, 0, 0], "duration": 2000}
    asking = asyncio.ensure_future(client.ask(1004, params))
    await until(lambda: robot.actions.running())
    await forward(seconds=1.5)
    feet = robot[Legs].feet
    assert not feet[Foot.RIGHT_FRONT].grounded
    assert feet[Foot.RIGHT_FRONT].position.z == pytest.approx(0.08, abs=0.01)
    assert [feet[foot].grounded for foot in (Foot.LEFT_FRONT, Foot.RIGHT_REAR, Foot.LEFT_REAR)] == [True] * 3
    assert robot[Legs].attitude.roll > 0.05
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 213
    await forward(seconds=3)
    assert (await asking)["code"] == 0
    assert robot[Legs].feet[Foot.RIGHT_FRONT].grounded
    assert (await client.ask(1004, {"motion_id": 400}))["code"] == 3031  # that was not a program's sequence
    assert (await client.ask(1004, {**params, "duration": 0}))["code"] == 3010
    assert (await client.ask(1004, {**params, "contact": 0b1010}))["code"] == 3010  # too long to stand on two feet


@pytest.mark.slow  # in short: test_dance_reports_timeout_and_lying_down_interrupts_it
async def test_dance_of_a_program_can_be_repeated(client, robot, world, forward) -> None:
    assert (await client.ask(1004, {"motion_id": 400}))["code"] == 3031
    assert (await client.ask(1004, {"motion_id": 401, "vel_des": [0.1, 0, 0]}))["code"] == 3031
    steps = [Step(1.0, Twist(0.2), BodyPose(attitude=Orientation(roll=0.1))), Step(1.0, Twist(yaw=0.5))]
    dance = robot[Legs].dance(steps, TROT, source="a program")
    await forward(seconds=4)
    assert dance.status.ended
    before = world.truth.pose_of("a")
    assert (await client.ask(1004, {"motion_id": 400, "duration": 500}))["code"] == 3010
    asking = asyncio.ensure_future(client.ask(1004, {"motion_id": 400}))
    await until(lambda: robot.actions.running())
    await forward(seconds=1)
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 400
    await forward(seconds=3)
    assert await asking == {"motion_id": 400, "result": True, "code": 0}
    went = world.truth.pose_of("a").relative_to(before)
    assert went.x == pytest.approx(0.2, abs=0.08)
    assert math.degrees(went.yaw) == pytest.approx(28, abs=8)

    before = world.truth.pose_of("a")
    walked = await answered(client, 1004, {"motion_id": 401, "vel_des": [0.2, 0, 0], "duration": 2000}, forward)
    assert walked["code"] == 0
    assert world.truth.pose_of("a").relative_to(before).x == pytest.approx(0.4, abs=0.12)
    assert list(robot[Legs].choreography.steps) == steps  # 400 still repeats the program's


async def test_gait_places_are_empty_states_not_requestable(client, robot, world, forward) -> None:
    before = world.truth.pose_of("a")
    for number in (180, 199):
        assert (await client.ask(1004, {"motion_id": number}))["code"] == 3031
    for number in (114, 115):
        assert (await client.ask(1004, {"motion_id": number}))["code"] == 3022
    assert (await client.ask(1004, {"motion_id": 200}))["code"] == 3008
    assert robot.actions.running() == []
    assert world.truth.pose_of("a").distance_to(before) < 0.01


async def test_standing_after_a_walk_in_the_registered_way(client, robot, forward) -> None:
    await frames(client, forward, 5, motion_id=303, vel_des=[0.2, 0.0, 0.0])
    assert (await answered(client, 1004, {"motion_id": 113}, forward))["code"] == 0
    assert robot[Legs].posture is Posture.STANDING
    assert (await client.ask(1004, {"motion_id": 113, "duration": 100}))["code"] == 3010


async def test_feet_are_set_toed_in_or_straight_down(client, robot, world, forward) -> None:
    widths = []
    for value in (0, 2):
        width = 1.0
        for _ in range(10):
            await client.ask(1002, {"motion_id": 303, "vel_des": [0.2, 0, 0], "value": value})
            await forward(seconds=0.1)
            feet = robot[Legs].feet
            width = min(width, *(abs(feet[foot].position.y) for foot in Foot if feet[foot].grounded))
        widths.append(width)
    assert widths[1] - widths[0] == pytest.approx(0.02, abs=0.005)


async def test_a_frame_begins_the_calibration(client, robot, forward) -> None:
    for _ in range(4):
        await client.ask(1002, {"motion_id": 303, "value": 4})
        await forward(seconds=0.1)
    await forward(seconds=5)
    assert robot[Legs].posture is Posture.LIMP
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 0
    assert (await answered(client, 1004, {"motion_id": 111}, forward))["code"] == 0


REFUSED = [
    ({"motion_id": 132, "duration": 10}, "motion 132 has its own time: leave duration out"),
    ({"motion_id": 303}, "motion 303 needs a duration in ms"),
    ({"motion_id": 303, "duration": 60_001}, "duration is 0 to 60000 ms"),
    ({"motion_id": 212, "duration": 500, "rpy_des": [0.0, 1.0, 0.0]}, "turns by at most 0.9 rad"),
    ({"motion_id": 211, "duration": 500, "pos_des": [0.0, 0.0, 0.9]}, "cannot be done with these values"),
    ({"motion_id": 99}, "there is no such motion"),
    ({"motion_id": 180}, "no such gait or sequence"),
]


async def test_log_names_why_a_motion_was_refused(client, caplog) -> None:
    caplog.set_level(logging.INFO)
    for values, why in REFUSED:
        caplog.clear()
        assert (await client.ask(1004, values))["result"] is False, values
        assert why in caplog.text, values


async def test_log_names_why_a_frame_was_refused(client, caplog) -> None:
    await client.ask(1002, {"motion_id": 303, "cmd_type": 7})
    assert "1002 refused: cmd_type is 0, 1 or 2, not 7" in caplog.text


def test_each_refusal_of_a_motion_has_its_reason() -> None:
    for code in MotionCode:
        assert code is MotionCode.DONE or reason(code, 303, MotionRequest())


async def test_a_dog_that_was_knocked_over_says_so(client, robot, world, forward) -> None:
    world.stage.roll_over("a")
    await forward(seconds=1)
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 115
    world.stage.roll_over("a", 0.0)
    await forward(seconds=1)
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 111


async def test_someone_takes_the_dog_up(client, robot, world, forward) -> None:
    world.stage.lift("a")
    await forward(seconds=1)
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 114
    walk = {"motion_id": 303, "vel_des": [0.2, 0.0, 0.0], "duration": 1000}
    assert (await client.ask(1004, walk))["code"] == 3003  # its feet find no floor
    world.stage.let_go("a")
    await forward(seconds=2)
    assert (await client.ask(10001))["motion_status"]["motion_id"] in (111, 112)
    await frames(client, forward, 6, motion_id=302, vel_des=[0.1, 0.0, 0.0])  # at times all feet are in the air
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 302


@pytest.mark.world(str(Path(__file__).parent / "sill.toml"), body="cyberdog2")
@pytest.mark.parametrize(
    ("number", "over"),
    [(340, False), (343, True), *(pytest.param(n, True, marks=pytest.mark.slow) for n in (344, 345))],
)
async def test_foresighted_walks_lift_feet_over_obstacles(
    client, robot, world, forward, number: int, over: bool
) -> None:
    world.stage.place("a", Pose(3.2, 2.0, 0.0))
    await forward(seconds=0.5)
    asking = asyncio.ensure_future(
        client.ask(1004, {"motion_id": number, "vel_des": [0.4, 0.0, 0.0], "duration": 4000})
    )
    await until(lambda: robot.actions.running())
    await forward(seconds=5)
    await asking
    assert (world.truth.pose_of("a").x > 4.3) is over


async def test_closed_door_ends_the_foresight_of_a_walk(client, door, forward) -> None:
    def looking() -> bool:
        return any(task.get_name() == "look ahead" for task in asyncio.all_tasks())

    asking = asyncio.ensure_future(client.ask(1004, {"motion_id": 343, "vel_des": [0.1, 0, 0], "duration": 5000}))
    await until(looking)
    door._context.gaits.close()
    await until(lambda: not looking())
    asking.cancel()
