"""cyberdog.motion.run_sequence, choreographer, dancer: dances of one's own on the simulated robot."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import pytest

from roboglot.model.components.motion.feet import Foot
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.errors import ComponentMissing, InvalidGoal
from roboglot.model.geometry import Pose
from roboglot.programs.functions.moving.choreography import Choreography
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.worker.records import Records
from roboglot.programs.worker.values import Record, pack, unpack
from roboglot.simulation.world.world import World
from roboglot.testing import assert_pose
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("empty", body="cyberdog2")
RECORDS = Records(ability_set().records)


FEET = ("right_forefoot", "left_forefoot", "right_hindfoot", "left_hindfoot")
STANDING: list[tuple[str, int]] = [("1111", 1)]
TROT = [("0110", 6), ("1111", 1), ("1001", 6), ("1111", 1)]


def record(kind: str, **fields: object) -> Any:
    """Return a new record of the language, whose constructor is made with its class."""
    make: Callable[..., object] = RECORDS.class_of(kind)
    return make(**fields)


def sequence(*paces: dict[str, Any], name: str = "hop", gaits: list[tuple[str, int]] = STANDING) -> Record:
    """Return a sequence as the worker sends it; a gait lists standing feet in the order of FEET, and 30 ms units."""
    made = record("MotionSequence", name=name)
    for down, duration in gaits:
        fields = {foot: int(digit) for foot, digit in zip(FEET, down, strict=True)}
        made.gait_list.push_back(record("MotionSequenceGait", duration=duration, **fields))
    for pace in paces:
        meta = record("MotionSequencePace")
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


@pytest.mark.parametrize("gaits", [TROT, []])
async def test_sequence_moves_robot_and_body_pace_by_pace(
    caller: Caller, world: World, gaits: list[tuple[str, int]]
) -> None:
    await ready(caller)
    legs, before, stood = caller.robot[Legs], world.truth.pose_of("a"), caller.robot[Legs].body_height
    paces = (
        {"twist__linear__x": 0.2, "centroid__position__z": -0.04, "duration": 1500},
        {"twist__linear__z": 45.0, "centroid__orientation__x": 10.0, "duration": 1000},
    )
    call = caller.start("cyberdog.motion.run_sequence", sequence(*paces, gaits=gaits))
    await caller.clock.advance(1.5)
    assert legs.body_height == pytest.approx(stood - 0.04, abs=0.01)
    await caller.clock.advance(1.0)
    assert math.degrees(legs.attitude.roll) == pytest.approx(10, abs=1)
    await caller.clock.advance(2.0)
    response = field(call.result(), "response").fields
    assert response == {"result": True, "code": 0, "describe": "success"}
    assert legs.posture is Posture.STANDING
    end = world.truth.pose_of("a").relative_to(before)
    assert (end.x, math.degrees(end.yaw)) == (pytest.approx(0.3, abs=0.06), pytest.approx(45, abs=5))


async def test_feet_step_where_the_paces_say(caller: Caller) -> None:
    await ready(caller)
    await caller.clock.advance(1.0)
    legs = caller.robot[Legs]
    pace = {"right_forefoot__x": 0.03, "right_forefoot__y": 0.05, "right_forefoot__w": 0.06, "duration": 2000}
    call = caller.start("cyberdog.motion.run_sequence", sequence(pace, gaits=[("0110", 10), ("1111", 90)]))
    tops = dict.fromkeys(Foot, 0.0)
    for _ in range(75):
        await caller.clock.advance(0.02)
        for foot, state in legs.feet.items():
            tops[foot] = max(tops[foot], state.position.z)
    assert tops[Foot.RIGHT_FRONT] == pytest.approx(0.06, abs=0.003)
    assert tops[Foot.LEFT_REAR] == pytest.approx(0.005, abs=0.001)  # w is 0: as low as it goes
    assert tops[Foot.LEFT_FRONT] == tops[Foot.RIGHT_REAR] == 0.0
    position = legs.feet[Foot.RIGHT_FRONT].position
    assert (position.x, position.y) == (pytest.approx(0.21, abs=0.005), pytest.approx(-0.075, abs=0.005))
    await caller.clock.advance(3.0)
    assert field(call.result(), "response.result") is True


async def test_without_a_step_the_robot_leans_and_stays(caller: Caller, world: World) -> None:
    await ready(caller)
    before = world.truth.pose_of("a")
    call = caller.start("cyberdog.motion.run_sequence", sequence({"twist__linear__x": 0.3, "duration": 3000}))
    await caller.clock.advance(5.0)
    assert field(call.result(), "response.result") is True
    assert 0.05 < world.truth.pose_of("a").relative_to(before).x < 0.17


async def test_an_axis_without_weight_keeps_what_it_had(caller: Caller, world: World) -> None:
    await ready(caller)
    before, legs, stood = world.truth.pose_of("a"), caller.robot[Legs], caller.robot[Legs].body_height
    only = {"weight__linear__y": 50.0, "weight__angular__x": 10.0}
    wanted = {"twist__linear__x": 0.3, "twist__linear__y": 0.1, "centroid__position__z": -0.05}
    call = caller.start(
        "cyberdog.motion.run_sequence",
        sequence({**only, **wanted, "centroid__orientation__x": 10.0, "duration": 2000}, gaits=TROT),
    )
    await caller.clock.advance(2.0)
    assert legs.body_height == pytest.approx(stood, abs=0.01)
    assert math.degrees(legs.attitude.roll) == pytest.approx(10, abs=1)
    await caller.clock.advance(2.0)
    assert call.done()
    assert_pose(world.truth.pose_of("a").relative_to(before), x=0.0, y=0.2, deg=0, within=0.03)


def refused() -> list[tuple[Record, str]]:
    """Sequences that make no sense, and words of the answer to each."""
    return [
        (sequence(name="2 hops"), "name"),
        (sequence(), "needs paces"),
        (sequence({"landing_gain": 1.6}), "landing_gain"),
        (sequence({"friction_coefficient": 0.0}), "friction"),
        (sequence({"duration": -1}), "too long or too fast"),
        (sequence({"twist__linear__x": 1.7}), "x_velocity = 1.7 is outside"),
        (sequence({"twist__linear__y": 1.3}), "y_velocity"),
        (sequence({"twist__linear__z": -115.0}), "z_velocity"),
        (sequence({"centroid__position__x": 0.41}), "centroid_x"),
        (sequence({"centroid__position__z": -0.21}), "centroid_z"),
        (sequence({"centroid__orientation__y": 52.0}), "pitch = 52 is outside"),
        (sequence({"twist__linear__x": math.nan}), "is a number"),
        (sequence({"twist": 3}), "is a number"),
        (sequence(*[{}] * 1001), "at most 1000"),
        (sequence({}, gaits=[("0110", 21), ("1111", 1)]), "would fall with 2 feet down"),
        (sequence({}, gaits=[("0000", 11), ("1111", 1)]), "would fall with 0 feet down"),
        (sequence({}, gaits=[("1111", 0)]), "a duration above 0"),
        (sequence({"right_forefoot__x": 0.16}), "beside its place"),
        (sequence({"left_hindfoot__w": 0.2}), "are lifted"),
        (sequence({"left_hindfoot__w": -0.01}), "are lifted"),
        (sequence({"weight__linear__x": -1.0}), "weight"),
        (Record("MotionSequence", {"name": "a", "gait_list": [], "pace_list": [1]}), "list of MotionSequencePace"),
    ]


@pytest.mark.slow
async def test_invalid_sequences_move_nothing(caller: Caller) -> None:
    for made, words in refused():
        result = await caller("cyberdog.motion.run_sequence", made)
        assert field(result, "state.code") == 1, words
        assert (field(result, "response.result"), field(result, "response.code")) == (False, 3010), words
        assert words in field(result, "response.describe")
        assert not caller.robot.actions.history, words


async def test_only_a_sequence_is_one(caller: Caller) -> None:
    with pytest.raises(TypeError, match="MotionSequence"):
        await caller("cyberdog.motion.run_sequence", 5)


async def test_a_moonwalk_slides_away(caller: Caller, world: World) -> None:
    await ready(caller)
    before, legs = world.truth.pose_of("a"), caller.robot[Legs]
    assert await caller("choreographer.moonwalk", -0.5, 0, 0.04, 3) is None  # 0.5 is cut to 0.08
    assert world.truth.pose_of("a").distance_to(before) < 0.01
    dancing = caller.start("dancer.dance")
    await caller.clock.advance(0.4 + 0.25)
    assert legs.attitude.roll > 0.05
    places: dict[Foot, list[float]] = {foot: [] for foot in Foot}
    start = caller.clock.time()
    while not dancing.done() and caller.clock.time() < start + 60:
        for foot, state in legs.feet.items():
            x = world.truth.pose_of("a").compose(Pose(state.position.x, state.position.y)).x
            if state.grounded and (not places[foot] or abs(x - places[foot][-1]) > 0.01):
                places[foot].append(x)
        await caller.clock.advance(0.02)
    assert dancing.result() is None
    # A beat is half a stride's time: 0.25 s, twelve of them.
    assert_pose(world.truth.pose_of("a").relative_to(before), x=-0.08 * 0.25 * 12, y=0.0, deg=0, within=0.02)
    for footprints in places.values():
        steps = [after - before for before, after in itertools.pairwise(footprints)]
        assert sum(step == pytest.approx(-0.04, abs=0.006) for step in steps) >= 3  # in the middle each is a stride


async def test_push_ups_are_counted_by_the_bodys_height(caller: Caller) -> None:
    await ready(caller)
    legs = caller.robot[Legs]
    stood = legs.body_height
    await caller("choreographer.push_up", 10**400, -(10**400))  # limited to 60 a minute, and to two
    assert len(caller.session.part(Choreography).steps) == 4
    await caller("choreographer.push_up", 30, 3)
    dancing, low, count = caller.start("dancer.dance"), False, 0
    start = caller.clock.time()
    while not dancing.done() and caller.clock.time() < start + 60:
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
