"""cyberdog.motion.run_sequence, choreographer, dancer: dances of one's own on the simulated robot."""

from __future__ import annotations

import math
from typing import Any

import pytest
from calling import Caller, field

from roboglot.model.components.legs import Legs, Posture
from roboglot.model.errors import ComponentMissing, InvalidGoal
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.worker.records import Records
from roboglot.programs.worker.values import Record, pack, unpack
from roboglot.simulation.world import World
from roboglot.testing import assert_pose

pytestmark = pytest.mark.world("empty", body="cyberdog2")
RECORDS = Records(ability_set().records)


def sequence(*paces: dict[str, Any], name: str = "hop", gaits: int = 1) -> Record:
    """As a program makes it and the worker sends it."""
    made: Any = RECORDS.class_of("MotionSequence")(name=name)
    for _ in range(gaits):
        made.gait_list.push_back(RECORDS.class_of("MotionSequenceGait")(duration=1))
    for pace in paces:
        meta: Any = RECORDS.class_of("MotionSequencePace")()
        for path, value in pace.items():
            *way, last = path.split("__")
            part = meta
            for step in way:
                part = getattr(part, step)
            setattr(part, last, value)
        made.pace_list.push_back(meta)
    sent = unpack(pack(made, RECORDS.split))
    assert isinstance(sent, Record)
    return sent


async def ready(caller: Caller) -> None:
    await caller("cyberdog.motion.go_straight", 0.4, 1.5)
    await caller.clock.advance(1.5)


async def test_a_sequence_moves_robot_and_body_pace_by_pace(caller: Caller, world: World) -> None:
    await ready(caller)
    legs, before, stood = caller.robot[Legs], world.pose_of("a"), caller.robot[Legs].body_height
    paces = (
        {"twist__linear__x": 0.2, "centroid__position__z": -0.04, "duration": 1500},
        {"twist__linear__z": 45.0, "centroid__orientation__x": 10.0, "duration": 1000},
    )
    call = caller.start("cyberdog.motion.run_sequence", sequence(*paces))
    await caller.clock.advance(1.5)
    assert legs.body_height == pytest.approx(stood - 0.04, abs=0.01)
    await caller.clock.advance(1.0)
    assert math.degrees(legs.attitude.roll) == pytest.approx(10, abs=1)
    await caller.clock.advance(2.0)
    response = field(call.result(), "response").fields
    assert response == {"result": True, "code": 0, "describe": "success"}
    assert legs.posture is Posture.STANDING
    end = world.pose_of("a").relative_to(before)
    assert (end.x, math.degrees(end.yaw)) == (pytest.approx(0.3, abs=0.06), pytest.approx(45, abs=5))


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (sequence(name="2 hops"), "name"),
        (sequence(), "has paces"),
        (sequence({"landing_gain": 1.6}), "landing_gain"),
        (sequence({"friction_coefficient": 0.0}), "friction"),
        (sequence({"duration": -1}), "too long or too fast"),
        (sequence({"twist__linear__x": 99.0}), "too fast"),
        (sequence({"twist__linear__x": math.nan}), "is a number"),
        (sequence({"twist": 3}), "is a number"),
        (sequence(*[{}] * 1001), "at most 1000"),
        (Record("MotionSequence", {"name": "a", "gait_list": [], "pace_list": [1]}), "list of MotionSequencePace"),
    ],
)
async def test_what_makes_no_sense_moves_nothing(caller: Caller, made: Record, words: str) -> None:
    result = await caller("cyberdog.motion.run_sequence", made)
    assert field(result, "state.code") == 1
    assert (field(result, "response.result"), field(result, "response.code")) == (False, 3010)
    assert words in field(result, "response.describe")
    assert not caller.robot.actions.history


async def test_only_a_sequence_is_one(caller: Caller) -> None:
    with pytest.raises(TypeError, match="MotionSequence"):
        await caller("cyberdog.motion.run_sequence", 5)


async def test_a_moonwalk_slides_away(caller: Caller, world: World) -> None:
    await ready(caller)
    before, legs = world.pose_of("a"), caller.robot[Legs]
    assert await caller("choreographer.moonwalk", -0.5, 0, 0.04, 3) is None  # 0.5 is cut to 0.08
    assert world.pose_of("a").distance_to(before) < 0.01
    dancing = caller.start("dancer.dance")
    await caller.clock.advance(0.4 + 0.25)
    assert legs.attitude.roll > 0.05
    await caller.clock.advance(6.0)
    assert dancing.result() is None
    # A beat is half a stride's time: 0.25 s, twelve of them.
    assert_pose(world.pose_of("a").relative_to(before), x=-0.08 * 0.25 * 12, y=0.0, deg=0, within=0.04)


async def test_push_ups_are_counted_by_the_bodys_height(caller: Caller) -> None:
    await ready(caller)
    legs = caller.robot[Legs]
    stood = legs.body_height
    await caller("choreographer.push_up", 30, 3)
    dancing, low, count = caller.start("dancer.dance"), False, 0
    start = caller.clock.time()
    while not dancing.done():
        await caller.clock.advance(0.1)
        if not low and legs.body_height < stood - 0.06:
            low, count = True, count + 1
        low = low and legs.body_height < stood - 0.02
    assert count == 3
    assert 6.0 < caller.clock.time() - start < 7.5


async def test_dancing_needs_a_dance_and_legs(caller: Caller, bare_caller: Caller) -> None:
    with pytest.raises(InvalidGoal):
        await caller("dancer.dance")
    await bare_caller("choreographer.push_up", 30, 3)
    with pytest.raises(ComponentMissing):
        await bare_caller("dancer.dance")
    with pytest.raises(ValueError, match="not a number"):
        await bare_caller("choreographer.moonwalk", math.nan, 0, 0.1, 1)
