"""Tap of a real robot: requests and answers of its driver, byte for byte as the robot hears them."""

from __future__ import annotations

import pytest

from roboglot.clients.errors import ClientError
from roboglot.clients.slamware import SlamwareClient
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.model.tap import LOST, Direction, Exchange, Tap
from roboglot.testing import Forward


def said(exchanges: list[Exchange], door: str, direction: Direction) -> list[tuple[str, bytes]]:
    """Operations and bytes of what went that way, without what a text ends with."""
    wanted = [found for found in exchanges if found.door == door and found.direction is direction]
    return [(found.operation, found.payload.rstrip(b"; ")) for found in wanted]


async def both_ends(kind: str, robot: Robot, driven: Robot, forward: Forward) -> None:
    """Follow the robot's door and its driver for a while, and compare."""
    assert not driven.tap.watched
    here: list[Exchange] = []
    there: list[Exchange] = []
    leave = robot.tap.listen(there.append), driven.tap.listen(here.append)
    driven[Driving].move_by(Pose(0.1), source="test")
    for _ in range(20):
        await forward(seconds=0.1)
    driver = f"driver/{kind}"
    mine, theirs = said(here, driver, Direction.REQUEST), said(there, kind, Direction.REQUEST)
    assert len(mine) > 10
    assert set(theirs[:-10]) <= set(mine)
    assert set(mine[:-10]) <= set(theirs)
    assert "" not in {operation for operation, _ in mine}
    answers, given = said(here, driver, Direction.REPLY), said(there, kind, Direction.REPLY)
    assert len(answers) > 10
    assert set(answers[10:-10]) <= set(given)
    pushes = set(said(here, driver, Direction.PUSH))
    assert pushes <= set(said(there, kind, Direction.PUSH))
    assert bool(pushes) == (kind == "robomaster")
    for end in leave:
        end()
    count = len(here)
    await forward(seconds=0.5)
    assert len(here) == count
    assert not driven.tap.watched


async def test_both_ends_of_rest_note_the_same(driven: Robot, robot: Robot, forward: Forward) -> None:
    await both_ends("slamware", robot, driven, forward)


async def test_both_ends_of_text_note_the_same(driven_ep: Robot, robot: Robot, forward: Forward) -> None:
    await both_ends("robomaster", robot, driven_ep, forward)


async def test_missing_answers_are_noted(clock: LockstepClock) -> None:
    tap, heard = Tap("a", clock), list[Exchange]()
    tap.listen(heard.append)
    client = SlamwareClient("127.0.0.1", 9, clock=clock)
    client.note_in(tap.line("slamware", "127.0.0.1:9"))
    with pytest.raises(ClientError):
        await client.get_power_status()
    client.close()
    assert [(found.direction, found.status) for found in heard] == [(Direction.REQUEST, ""), (Direction.REPLY, LOST)]
    assert "cannot be reached" in heard[1].refusal
