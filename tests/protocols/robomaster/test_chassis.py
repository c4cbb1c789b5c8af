"""The chassis: transcripts of every command, and what they do to the robot."""

import asyncio
import math

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import Pose
from tests.masking import mask_bumper

PARSE_ERROR = "command format error: command parse error;"
OK, FAIL = "ok;", "fail;"


TRANSCRIPT = [
    ("chassis speed x 0.1 y 0.1 z 1;", OK),
    ("chassis speed z 1 x 0.1;", OK),
    ("chassis speed x 3.5 y -3.5 z 600;", OK),
    ("chassis speed x 0.300000 y 0 z -600.0;", OK),
    ("chassis speed x 0x1 colour blue;", OK),
    ("chassis speed x 3.51;", FAIL),
    ("chassis speed y -3.501;", FAIL),
    ("chassis speed z 600.1;", FAIL),
    ("chassis speed x fast;", FAIL),
    ("chassis speed x true;", FAIL),
    ("chassis speed x nan;", FAIL),
    ("chassis speed x 1e999;", FAIL),
    ("chassis speed x;", FAIL),
    ("chassis speed x y 1;", FAIL),
    ("chassis speed;", PARSE_ERROR),
    ("chassis speed 0.5;", PARSE_ERROR),
    ("chassis wheel w2 100 w1 12 w3 20 w4 11;", OK),
    ("chassis wheel w1 1000 w4 -1000;", OK),
    ("chassis wheel w1 10.6;", OK),
    ("chassis wheel w1 1001;", FAIL),
    ("chassis wheel w4 -1001;", FAIL),
    ("chassis wheel w2 x;", FAIL),
    ("chassis wheel;", PARSE_ERROR),
    ("chassis wheel ?;", PARSE_ERROR),
    ("chassis move x 0.1 y 0.2;", OK),
    ("chassis move x 5 y -5 z 1800 vxy 3.5 vz 600;", OK),
    ("chassis move z -30.000000 wait_for_complete false;", OK),
    ("chassis move x 5.01;", FAIL),
    ("chassis move y -5.01;", FAIL),
    ("chassis move z 1801;", FAIL),
    ("chassis move x 1 vxy 0;", FAIL),
    ("chassis move x 1 vxy 3.51;", FAIL),
    ("chassis move z 1 vz 0;", FAIL),
    ("chassis move z 1 vz 601;", FAIL),
    ("chassis move x 1 wait_for_complete maybe;", FAIL),
    ("chassis move x one;", FAIL),
    ("chassis move;", PARSE_ERROR),
    ("chassis move vxy 1 vz 30;", PARSE_ERROR),
    ("chassis move wait_for_complete true;", PARSE_ERROR),
    ("chassis push position on;", OK),
    ("chassis push position on pfreq 1 attitude on;", OK),
    ("chassis push attitude on afreq 1 status on sfreq 5;", OK),
    ("chassis push freq 10;", OK),
    ("chassis push freq 50.0;", OK),
    ("chassis push position pfreq 1 freq 5;", OK),
    ("chassis push position off attitude off status off;", OK),
    ("chassis push position on pfreq 2;", FAIL),
    ("chassis push freq 0;", FAIL),
    ("chassis push position maybe;", FAIL),
    ("chassis push;", PARSE_ERROR),
    ("chassis push ?;", PARSE_ERROR),
    ("chassis position;", PARSE_ERROR),
    ("chassis attitude;", PARSE_ERROR),
    ("chassis status;", PARSE_ERROR),
    ("chassis dance;", PARSE_ERROR),
]


async def test_transcript(client) -> None:
    for text, reply in TRANSCRIPT:
        assert await client.ask(text) == reply, text


async def test_a_command_out_of_range_moves_nothing(client, robot, forward) -> None:
    await client.ask("chassis speed x 0.5 z 601;")
    await forward(seconds=0.5)
    assert not robot.actions.running(BASE)


async def test_speed_signs_as_the_client_sees_them(client, robot, forward) -> None:
    """x forward, y right, z clockwise."""
    await client.ask("chassis speed x 0.3 y 0.2 z 0;")
    await forward(seconds=1.5)
    velocity = robot[Base].velocity
    assert (velocity.x, velocity.y) == pytest.approx((0.3, -0.2), abs=0.03)
    x, y, *_ = await client.numbers("chassis speed ?;")
    assert (x, y) == pytest.approx((0.3, 0.2), abs=0.05)
    await client.ask("chassis speed z 40;")
    await forward(seconds=1.5)
    assert math.degrees(robot[Base].velocity.yaw) == pytest.approx(-40, abs=3)
    assert (await client.numbers("chassis speed ?;"))[2] == pytest.approx(40, abs=4)


async def test_speed_lasts_without_more_words(client, robot, forward) -> None:
    await client.ask("chassis speed x 0.1;")
    await forward(seconds=6)
    assert robot[Base].velocity.x == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("text", ["chassis speed x 0 y 0 z 0;", "chassis wheel w1 0 w2 0 w3 0 w4 0;", "chassis stop;"])
async def test_standing_still_lets_the_base_go(client, robot, forward, text: str) -> None:
    await client.ask("chassis speed x 0.3;")
    await forward(seconds=1)
    assert await client.ask(text) == OK
    await forward(seconds=2)
    assert robot[Base].velocity.speed < 0.02
    assert not robot.actions.running(BASE)


@pytest.mark.parametrize(
    ("wheels", "moves"),
    [((40, 40, 40, 40), (1, 0, 0)), ((-40, 40, 40, -40), (0, -1, 0)), ((-40, 40, -40, 40), (0, 0, -1))],
)
async def test_wheels_are_numbered_as_the_manual_has_it(client, robot, forward, wheels, moves) -> None:
    """w1 front right, w2 front left, w3 rear right, w4 rear left: forward, to the right, clockwise."""
    await client.ask("chassis wheel w1 {} w2 {} w3 {} w4 {};".format(*wheels))
    await forward(seconds=1.5)
    reply = (await client.ask("chassis speed ?;")).rstrip(";").split()
    assert tuple(int(word) for word in reply[3:]) == wheels
    velocity = robot[Base].velocity
    assert tuple(0 if abs(v) < 0.05 else math.copysign(1, v) for v in (velocity.x, velocity.y, velocity.yaw)) == moves


async def test_a_move_answers_at_once(client, robot, forward) -> None:
    start = robot[Odometry].reading.pose
    assert await client.ask("chassis move x 0.4 y 0.2 z 90;") == OK
    await forward(seconds=8)
    moved = robot[Odometry].reading.pose.relative_to(start)
    assert (moved.x, moved.y) == pytest.approx((0.4, -0.2), abs=0.02)
    assert math.degrees(moved.yaw) == pytest.approx(-90, abs=2)


async def test_awaited_move_answers_at_its_end(client, robot, forward) -> None:
    client.send("chassis move x 0.4 vxy 0.4 wait_for_complete true;robot mode ?;")
    early = asyncio.ensure_future(client.reply())
    await asyncio.sleep(0.05)
    await forward(seconds=0.5)
    await asyncio.sleep(0.05)
    assert not early.done(), "the next command waits too"
    await forward(seconds=5)
    assert await early == OK
    assert await client.reply() == "chassis_lead;"


async def test_a_move_that_is_taken_over_fails(client, connect, forward) -> None:
    client.send("chassis move x 1 wait_for_complete True;")
    await asyncio.sleep(0.05)
    await forward(seconds=0.5)
    other = await connect()
    assert await other.ask("chassis speed x 0.1;") == OK
    await forward(seconds=3)
    assert await client.reply() == FAIL


async def test_no_one_waits_for_ever(client, robot, forward, monkeypatch) -> None:
    monkeypatch.setattr("roboglot.protocols.robomaster.waiting.WAIT_MAX", 1.0)
    client.send("chassis move x 2 vxy 0.2 wait_for_complete true;")
    await asyncio.sleep(0.05)
    await forward(seconds=1.1)
    assert await client.reply() == FAIL
    assert robot.actions.running(BASE), "the move goes on"


async def test_top_speeds_are_kept(client, robot, forward) -> None:
    await client.ask("chassis move x 1 vxy 0.2;")
    await forward(seconds=2)
    assert robot[Base].velocity.x == pytest.approx(0.2, abs=0.03)
    await client.ask("chassis move z 180 vz 20;")
    await forward(seconds=3)
    assert math.degrees(robot[Base].velocity.yaw) == pytest.approx(-20, abs=3)


async def test_position_and_attitude(client, robot, forward) -> None:
    assert await client.numbers("chassis position ?;") == pytest.approx([0, 0, 0], abs=0.5)
    await client.ask("chassis move x 0.3 z 45 vz 90;")
    await forward(seconds=6)
    pose = robot[Odometry].reading.pose
    assert isinstance(pose, Pose)
    x, y, z = await client.numbers("chassis position ?;")
    assert (x, y, z) == pytest.approx((pose.x, -pose.y, -math.degrees(pose.yaw)), abs=0.001)
    assert z == pytest.approx(45, abs=2)
    pitch, roll, yaw = await client.numbers("chassis attitude ?;")
    assert (pitch, roll) == pytest.approx((0, 0), abs=2)
    assert yaw == pytest.approx(45, abs=4)


async def test_status_is_static_or_not(client, forward) -> None:
    await forward(seconds=0.5)
    assert await client.ask("chassis status ?;") == "1 0 0 0 0 0 0 0 0 0 0;"
    await client.ask("chassis speed x 0.2;")
    await forward(seconds=1)
    assert await client.ask("chassis status ?;") == "0 0 0 0 0 0 0 0 0 0 0;"


async def test_driving_into_a_wall_is_an_impact(client, robot, forward) -> None:
    mask_bumper(robot)  # its bumpers would brake: a touch at 0.1 m/s is no impact
    await client.ask("chassis speed x 0.5;")
    for _ in range(600):
        await forward(seconds=0.1)
        flags = (await client.ask("chassis status ?;")).rstrip(";").split()
        if "1" in flags[6:8]:
            return
    pytest.fail("no impact along x or y")
