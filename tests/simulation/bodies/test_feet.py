"""Single feet: how they step while the dog walks and dances, and where they let it go."""

from __future__ import annotations

import itertools
import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.feet import (
    TROT,
    Foot,
    Footfall,
    Foothold,
)
from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import (
    BodyPose,
    FootLift,
    Legs,
    Step,
)
from roboglot.model.components.motion.motions import Motion
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.bodies.footfalls import FootfallCycle, walking

TICK = 0.02
ALL = frozenset(Foot)
DIAGONAL = frozenset({Foot.LEFT_FRONT, Foot.RIGHT_REAR})


@pytest.fixture
def dog(simulate):
    sim = simulate(start=Pose(2, 5), body="cyberdog2")
    sim.world.start()
    return sim


def placed(dog, foot: Foot) -> Pose:
    """Return the place of a foot in the world."""
    position = dog.robot[Legs].feet[foot].position
    return dog.pose.compose(Pose(position.x, position.y))


def grounded(dog) -> set[Foot]:
    return {foot for foot, state in dog.robot[Legs].feet.items() if state.grounded}


async def watched(dog, seconds: float):
    """The feet at every tick."""
    seen = []
    for _ in range(round(seconds / TICK)):
        await dog.clock.advance(TICK)
        seen.append(dict(dog.robot[Legs].feet))
    return seen


async def test_stands_on_four_feet_below_its_hips(dog):
    await dog.clock.advance(0.2)
    feet = dog.robot[Legs].feet
    assert list(feet) == list(Foot)
    assert all(state.grounded and state.position.z == 0.0 for state in feet.values())
    assert (feet[Foot.LEFT_REAR].position.x, feet[Foot.LEFT_REAR].position.y) == pytest.approx((-0.18, 0.125), abs=1e-3)


async def test_trot_lifts_diagonal_pairs_and_planted_feet_hold(dog):
    dog.robot[Legs].walk(Gait.TROT_SLOW, FootLift(0.05, 0.03))
    dog.robot[Base].set_velocity(Twist(0.4))
    await dog.clock.advance(1.0)
    tops, pairs, planted = dict.fromkeys(Foot, 0.0), set(), None
    for _ in range(100):
        down, where = grounded(dog), {foot: placed(dog, foot) for foot in Foot}
        pairs.add(frozenset(ALL - down))
        if planted:
            for foot in down & planted[0]:
                assert where[foot].distance_to(planted[1][foot]) < 1e-3
        planted = (down, where)
        for foot, state in dog.robot[Legs].feet.items():
            tops[foot] = max(tops[foot], state.position.z)
        await dog.clock.advance(TICK)
    assert pairs == {frozenset(), frozenset(DIAGONAL), frozenset(ALL - DIAGONAL)}
    assert tops[Foot.RIGHT_FRONT] == pytest.approx(0.05, abs=0.002)
    assert tops[Foot.LEFT_REAR] == pytest.approx(0.03, abs=0.002)


async def test_standing_robot_puts_its_feet_in_order(dog):
    dog.robot[Base].set_velocity(Twist(0.5, 0.0, 0.6))
    await dog.clock.advance(2.13)
    dog.robot[Base].set_velocity(Twist())
    await dog.clock.advance(2.0)
    assert grounded(dog) == ALL
    for foot, (x, y) in zip(Foot, ((0.18, -0.125), (0.18, 0.125), (-0.18, -0.125), (-0.18, 0.125)), strict=True):
        position = dog.robot[Legs].feet[foot].position
        assert (position.x, position.y) == pytest.approx((x, y), abs=0.012)
    before = dog.robot[Legs].feet
    await dog.clock.advance(1.0)
    assert dog.robot[Legs].feet == before


@pytest.mark.parametrize(
    ("gait", "most", "never"), [(Gait.PRONK, 4, set()), (Gait.BOUND, 2, set()), (Gait.THREE_LEGS, 2, {0})]
)
def test_gaits_differ_in_who_is_in_the_air(gait, most, never):
    seen = [walking(gait, strides / 100, FootLift()) for strides in range(100)]
    assert max(sum(swing is not None for swing in swings) for swings in seen) == most
    assert {index for index in range(4) if all(swings[index] for swings in seen)} == never


def test_flight_goes_on_over_end_of_the_order():
    order = FootfallCycle([Footfall(0.1, DIAGONAL), Footfall(0.2, ALL), Footfall(0.1, DIAGONAL)])
    holds = (Foothold(),) * 4
    swing = order.swings(0.3 + 1e-9, holds, 1.0)[0]
    assert swing is not None
    assert (swing.left, swing.stand) == pytest.approx((0.2, 0.2), abs=1e-6)
    later = order.swings(0.45, holds, 1.0)[0]
    assert later is not None
    assert later.share == pytest.approx(0.75)
    assert order.swings(0.6, holds, 1.0) == (None,) * 4


@pytest.mark.parametrize("landing", [0.0, 0.5, 1.0, 1.5])
def test_landing_reports_how_fast_a_foot_comes_down(landing):
    order = FootfallCycle([Footfall(1.0, DIAGONAL), Footfall(1.0, ALL)])
    heights = [
        swing.rise for part in range(1000) if (swing := order.swings(part / 1000, (Foothold(),) * 4, landing)[0])
    ]
    assert max(heights) == pytest.approx(1.0, abs=0.12)
    assert heights[-1] * 1000 == pytest.approx(landing * math.pi, abs=0.1)


async def test_without_steps_the_legs_hold_the_body_back(dog):
    action = dog.robot[Legs].dance([Step(3.0, Twist(0.2))], [Footfall(1.0, ALL)])
    await dog.clock.advance(2.9)
    assert dog.pose.x - 2.0 == pytest.approx(0.15, abs=0.01)  # of 0.6 m: the reach of the legs
    await dog.clock.advance(2.0)
    assert action.status is ActionStatus.SUCCEEDED
    walked = dog.robot[Legs].dance([Step(3.0, Twist(0.2))], TROT)
    await dog.clock.advance(5.0)
    assert walked.status is ActionStatus.SUCCEEDED
    assert dog.pose.x - 2.15 == pytest.approx(0.6, abs=0.03)


async def test_a_foot_comes_down_where_it_should(dog):
    holds = (Foothold(0.03, 0.05, lift=0.06), Foothold(), Foothold(), Foothold(-0.03, -0.05, 0.04, 0.06))
    falls = [Footfall(0.4, DIAGONAL), Footfall(9.0, ALL)]
    dog.robot[Legs].dance([Step(2.0, footholds=holds)], falls)
    seen = await watched(dog, 1.5)
    assert max(feet[Foot.RIGHT_FRONT].position.z for feet in seen) == pytest.approx(0.06, abs=0.003)
    right = seen[-1][Foot.RIGHT_FRONT]
    assert right.grounded
    assert (right.position.x, right.position.y) == pytest.approx((0.21, -0.075), abs=0.003)
    left = seen[-1][Foot.LEFT_REAR]  # ending above the floor, it carries no load
    assert not left.grounded
    assert (left.position.x, left.position.z) == pytest.approx((-0.21, 0.04), abs=0.003)
    assert all(feet[Foot.LEFT_FRONT].grounded for feet in seen)


async def test_a_raised_foot_stays_up(dog):
    dog.robot[Legs].dance([Step(2.0)], [Footfall(5.0, ALL - {Foot.LEFT_FRONT})])
    for feet in (await watched(dog, 1.5))[20:]:
        assert feet[Foot.LEFT_FRONT].position.z == pytest.approx(0.03)
        assert not feet[Foot.LEFT_FRONT].grounded
        assert feet[Foot.RIGHT_FRONT].grounded


@pytest.mark.parametrize(
    ("falls", "holds", "words"),
    [
        ([Footfall(0.31, frozenset())], (), "would fall with 0 feet"),
        ([Footfall(0.4, DIAGONAL), Footfall(0.4, DIAGONAL), Footfall(1.0, ALL)], (), "would fall with 2 feet"),
        ([Footfall(0.4, DIAGONAL), Footfall(1.0, ALL), Footfall(0.4, DIAGONAL)], (), "would fall with 2 feet"),
        ([Footfall(0.01, ALL)], (), "a footfall takes"),
        ([Footfall(math.nan, ALL)], (), "a footfall takes"),
        ([Footfall(0.1, ALL)] * 1001, (), "at most 1000 footfalls"),
        (TROT, (Foothold(x=0.2),) * 4, "beside its place"),
        (TROT, (Foothold(y=math.nan),) * 4, "beside its place"),
        (TROT, (Foothold(lift=0.11),) * 4, "are lifted by"),
        (TROT, (Foothold(),) * 3, "4 footholds"),
    ],
)
async def test_impossible_dances_move_nothing(dog, falls, holds, words):
    with pytest.raises(InvalidGoal, match=words):
        dog.robot[Legs].dance([Step(1.0, footholds=holds)], falls)
    assert not dog.robot.actions.history


async def test_slippery_floors_are_started_on_slowly(dog):
    dog.robot[Legs].dance([Step(1.0, Twist(0.6), friction=0.1)], TROT)
    speeds = []
    for _ in range(40):
        await dog.clock.advance(TICK)
        speeds.append(dog.robot[Base].velocity.x)
    assert all(b - a <= 0.1 * 9.81 * TICK + 1e-9 for a, b in itertools.pairwise(speeds))
    assert speeds[-1] == pytest.approx(0.6)


async def test_feet_leave_the_floor_in_a_jump(dog):
    action = dog.robot[Legs].perform(Motion.JUMP_UP_30)
    seen = await watched(dog, 2.0)
    assert any(not any(state.grounded for state in feet.values()) for feet in seen)
    assert action.status is ActionStatus.SUCCEEDED
    await dog.clock.advance(1.0)
    assert grounded(dog) == ALL


async def test_a_body_pose_moves_no_foot(dog):
    before = {foot: placed(dog, foot) for foot in Foot}
    dog.robot[Legs].hold(BodyPose(0.15), duration=0.5)
    await dog.clock.advance(1.0)
    assert all(placed(dog, foot).distance_to(before[foot]) < 1e-3 for foot in Foot)


@pytest.mark.parametrize("body", ["robomaster_ep", "universal"])
async def test_robot_on_wheels_has_no_feet_but_dances(simulate, body):
    sim = simulate(start=Pose(2, 5), body=body)
    sim.world.start()
    if Legs not in sim.robot:
        return
    assert not sim.robot[Legs].feet
    action = sim.robot[Legs].dance([Step(1.0, Twist(0.2))], [Footfall(1.0, ALL)])
    await sim.clock.advance(3.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert sim.pose.x - 2.0 == pytest.approx(0.2, abs=0.03)


async def test_cameras_see_a_paw_that_is_lifted(simulate):
    sim = simulate(start=Pose(3, 5), body="cyberdog2", robots=("a", "b"))
    sim.world.start()
    sim.world.stage.place("b", Pose(4.5, 5.0, 1.2))
    await sim.clock.advance(0.5)
    before = (await sim.robot[Camera].capture()).rgb().astype(int)
    other = sim.robots["b"][Legs]
    other.dance([Step(2.0)], [Footfall(5.0, ALL - {Foot.LEFT_FRONT})])
    await sim.clock.advance(1.0)
    changed = abs((await sim.robot[Camera].capture()).rgb().astype(int) - before).sum(axis=2) > 60
    rows, columns = changed.nonzero()
    assert 300 < len(rows) < 20_000
    assert rows.min() > 500  # nothing above the belly, and only at that leg
    assert columns.max() < 640


@pytest.mark.parametrize(
    ("motion", "turns"),
    [
        (Motion.SHAKE_LEFT_HAND, {frozenset({Foot.LEFT_FRONT})}),
        (Motion.LIFT_REAR_LEGS, {frozenset({Foot.LEFT_REAR}), frozenset({Foot.RIGHT_REAR})}),
        (Motion.STEP_AND_NOD, {DIAGONAL, ALL - DIAGONAL}),
        (Motion.STRETCH, set()),
    ],
)
async def test_figures_lift_paws_that_they_are_named_for(dog, motion, turns):
    before = dog.pose
    action = dog.robot[Legs].perform(motion)
    seen, last = set(), dict.fromkeys(Foot, 0.0)
    for _ in range(round(16 / TICK)):
        await dog.clock.advance(TICK)
        feet = dog.robot[Legs].feet
        assert all(abs(feet[foot].position.z - last[foot]) < 0.025 for foot in Foot)  # and none is raised
        last = {foot: feet[foot].position.z for foot in Foot}
        seen.add(ALL - grounded(dog))
    assert action.status is ActionStatus.SUCCEEDED
    assert turns <= seen
    assert set().union(*seen) == set().union(*turns)
    assert dog.pose.distance_to(before) < 0.02
