"""Bumpers during motion, as clients of the text protocol see them."""

import asyncio

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose

OK, FAIL = "ok;", "fail;"
pytestmark = pytest.mark.world("empty", body="robomaster_ep")


async def test_wall_fails_move_and_only_away_is_free(client, robot, world, forward) -> None:
    world.stage.place("a", Pose(9.0, 5.0, 0.0))
    await forward(seconds=0.5)
    client.send("chassis move x 3 wait_for_complete true;")
    waiting = asyncio.ensure_future(client.reply())
    await asyncio.sleep(0.05)
    await forward(seconds=4)
    assert await waiting == FAIL
    assert robot[Base].velocity.speed == 0.0
    assert await client.ask("chassis speed x 0.5;") == FAIL
    assert await client.ask("chassis wheel w1 50 w2 50 w3 50 w4 50;") == FAIL
    assert await client.ask("chassis speed x -0.5;") == OK
    await forward(seconds=1)
    assert await client.ask("chassis speed x 0;") == OK
    assert world.truth.pose_of("a").x < 9.5


async def test_speed_held_against_wall_brakes_within_100_ms(client, robot, world, forward) -> None:
    world.stage.place("a", Pose(9.0, 5.0, 0.0))
    await forward(seconds=0.5)
    assert await client.ask("chassis speed x 1;") == OK
    while world.truth.pose_of("a").x < 9.82:
        await forward(seconds=0.02)
    await forward(seconds=0.1)
    assert robot[Base].velocity.speed == 0.0
    await forward(seconds=3)
    assert robot[Base].velocity.speed == 0.0


@pytest.mark.parametrize("speed", [1.0, 3.5])
async def test_blow_is_an_impact_although_the_bumper_brakes(speed: float, client, world, forward) -> None:
    world.stage.place("a", Pose(6.5, 5.0, 0.0))
    await forward(seconds=0.5)
    assert await client.ask(f"chassis speed x {speed};") == OK
    flags = []
    while world.truth.pose_of("a").x < 9.8:
        await forward(seconds=0.1)
        flags.append((await client.ask("chassis status ?;")).rstrip(";").split()[6:8])
    await forward(seconds=0.1)
    assert (await client.ask("chassis status ?;")).rstrip(";").split()[6:8] == ["1", "0"]
    assert "1" not in [along for along, _ in flags[:-1]]


@pytest.mark.world("empty", body="hermes")
async def test_emergency_braking_fails_what_drives_on(client, world, forward) -> None:
    world.stage.place("a", Pose(3.0, 5.0, 0.0))
    world.stage.add_obstacle(Pose(4.5, 5.0), (0.3, 1.0, 1.0))
    await forward(seconds=0.5)
    answers = []
    for _ in range(8):
        answers.append(await client.ask("chassis speed x 0.5;"))
        await forward(seconds=3)
    where = world.truth.pose_of("a").x
    assert (answers[0], answers[-1]) == (OK, FAIL)
    assert await client.ask("chassis wheel w1 100 w2 100 w3 100 w4 100;") == FAIL
    await forward(seconds=1)
    assert world.truth.pose_of("a").x == pytest.approx(where, abs=0.01)
    assert await client.ask("chassis speed x -0.3;") == OK
    await forward(seconds=1)
    assert world.truth.pose_of("a").x < where - 0.1
