"""Reflecting strips come from the lidar's own scans: what the lidar does not reach does not shine."""

import math

import pytest

from roboglot.model.components.sensing.reflectors import Reflectors
from roboglot.model.geometry import Pose
from tests.simulation.perceiving import lab

STRIP = {"at": [6.0, 6.0], "facing": 180}
BEHIND = {"shape": "box", "at": [6.2, 6.0], "size": [0.4, 0.4, 1.0]}


async def shining(room):
    with room.robot[Reflectors].detector.subscribe() as viewer:
        await room.clock.advance(0.35)
        return viewer.drain()[-1].seen


async def test_a_strip_is_where_it_stands():
    with lab(reflectors=[STRIP], furniture=[BEHIND], start=Pose(2, 5, 0.5)) as room:
        (seen,) = await shining(room)
        truth = Pose(6.0, 6.0).relative_to(room.world.truth.pose_of("a"))
    assert math.dist((seen.place.x, seen.place.y), (truth.x, truth.y)) < 0.08
    assert seen.distance == pytest.approx(math.hypot(4, 1), abs=0.05)


@pytest.mark.parametrize(
    "things",
    [
        {"reflectors": [STRIP | {"facing": 0}], "furniture": [BEHIND]},  # its back
        {"reflectors": [STRIP | {"base": 0.6, "top": 0.9}], "furniture": [BEHIND]},  # above the lidar's plane
        {"reflectors": [STRIP], "furniture": [BEHIND], "walls": [{"from": [4, 4], "to": [4, 9]}]},
        {"reflectors": [STRIP | {"at": [16.0, 5.0]}], "size": 20.0},  # too far
    ],
)
async def test_a_strip_does_not_shine(things):
    with lab(**things) as room:
        assert await shining(room) == ()


async def test_detector_works_only_with_viewers():
    with lab(reflectors=[STRIP], furniture=[BEHIND]) as room:
        detector = room.robot[Reflectors].detector
        await room.clock.advance(0.5)
        assert detector.latest is None
        assert len(await shining(room)) == 1
        assert detector.latest is None
