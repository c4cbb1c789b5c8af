"""cyberdog.motion: motions of the table, attitudes and gaits, by what the simulated body does."""

from __future__ import annotations

import math

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.gaits import GAITS, Gait
from roboglot.model.components.motion.legs import FootLift, Legs, Posture
from roboglot.model.components.motion.motions import MOTIONS
from roboglot.model.geometry import Point, Pose
from roboglot.model.sensing import BatteryState
from roboglot.programs.functions.moving.performing import RESULT_MOTIONS
from roboglot.simulation.world.world import World
from roboglot.testing import assert_pose
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("empty", body="cyberdog2")
REFUSED = {"result": False, "code": 3010}


async def off_the_dock(caller: Caller) -> None:
    await caller("cyberdog.motion.go_straight", 0.4, 1.5)
    await caller.clock.advance(1.5)


@pytest.mark.slow  # in short: test_a_motion_ends_where_its_name_says
async def test_every_motion_of_the_table_is_performed(caller: Caller) -> None:
    legs = caller.robot[Legs]
    await off_the_dock(caller)
    for name, _, motion in RESULT_MOTIONS:
        if Posture.STANDING not in MOTIONS[motion].before:
            continue
        call = caller.start(f"cyberdog.motion.{name}")
        await caller.clock.advance(0.3)
        assert legs.performing is motion, name
        call.cancel()
        while caller.robot.actions.running():
            await caller.clock.advance(0.1)
    assert len({number for _, number, _ in RESULT_MOTIONS}) == len({m for *_, m in RESULT_MOTIONS}) == 51


@pytest.mark.parametrize(
    "name",
    [
        "back_flip",
        "jump3d_left90deg",
        "bow",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("jump3d_forward60cm", "space_walk")),
    ],
)
async def test_a_motion_ends_where_its_name_says(caller: Caller, world: World, name: str) -> None:
    number, motion = next((number, motion) for known, number, motion in RESULT_MOTIONS if known == name)
    await off_the_dock(caller)
    before, start = world.truth.pose_of("a"), caller.clock.time()
    result = await caller(f"cyberdog.motion.{name}")
    assert field(result, "state.code") == 0, result
    assert field(result, "response").fields == {"motion_id": number, "result": True, "code": 0}
    spec = MOTIONS[motion]
    end = world.truth.pose_of("a").relative_to(before)
    assert_pose(end, x=spec.way.x, y=spec.way.y, deg=math.degrees(spec.way.yaw), within=0.08, within_deg=8)
    assert caller.clock.time() - start == pytest.approx(spec.duration, abs=1.5)


@pytest.mark.parametrize(
    "name", ["jump3d_forward60cm", *(pytest.param(name, marks=pytest.mark.slow) for name in ("bow", "space_walk"))]
)
async def test_pausing_holds_a_motion(caller: Caller, world: World, name: str) -> None:
    await off_the_dock(caller)
    performing, start = caller.start(f"cyberdog.motion.{name}"), caller.clock.time()
    await caller.clock.advance(0.6)
    caller.session.pause()
    await caller.clock.advance(1.5)  # a jump lands first
    legs, before = caller.robot[Legs], world.truth.pose_of("a")
    held = legs.attitude, legs.body_height
    await caller.clock.advance(10.0)
    assert not performing.done()
    assert (legs.attitude, legs.body_height) == held
    assert world.truth.pose_of("a").distance_to(before) < 0.01
    caller.session.resume()
    await caller.clock.advance(20.0)
    assert field(performing.result(), "response.code") == 0
    assert caller.clock.time() - start > 11.5


async def test_wagging_needs_sitting_down_first(caller: Caller) -> None:
    legs = caller.robot[Legs]
    await off_the_dock(caller)
    refused = await caller("cyberdog.motion.shake_ass_left")
    assert (field(refused, "state.code"), field(refused, "response.code")) == (1, 3003)
    await caller("cyberdog.motion.sit_down")
    assert legs.posture is Posture.SITTING
    assert field(await caller("cyberdog.motion.shake_ass_left"), "response.code") == 0
    await caller("cyberdog.motion.resume_standing")
    assert legs.posture is Posture.STANDING


async def test_absolute_attitudes(caller: Caller) -> None:
    legs = caller.robot[Legs]
    result = await caller("cyberdog.motion.absolute_attitude", 0.25, 10, -15, 20, 1)
    assert field(result, "response.motion_id") == 201
    assert legs.body_height == pytest.approx(0.25, abs=0.01)
    held = [math.degrees(angle) for angle in (legs.attitude.roll, legs.attitude.pitch, legs.attitude.yaw)]
    assert held == pytest.approx([10, -15, 20])
    assert field(await caller("cyberdog.motion.absolute_attitude", yaw=25.8), "response.result") is True
    assert legs.attitude.yaw == pytest.approx(legs.limits.angle)
    result = await caller("cyberdog.motion.transition_standing", 0.12)
    assert field(result, "response.motion_id") == 211
    assert (legs.attitude.yaw, legs.body_height) == (0.0, pytest.approx(0.12, abs=0.01))


async def test_relative_attitudes_add_up(caller: Caller) -> None:
    legs = caller.robot[Legs]
    height = legs.body_height
    for _ in range(2):
        result = await caller("cyberdog.motion.relatively_force_control_attitude", 0.02, -0.01, -0.03, 0, 10)
    assert field(result, "response.motion_id") == 202
    assert legs.body_height == pytest.approx(height - 0.06, abs=0.01)
    assert math.degrees(legs.attitude.pitch) == pytest.approx(20)


async def test_turning_about_a_fulcrum_moves_the_body(caller: Caller) -> None:
    legs = caller.robot[Legs]
    height = legs.body_height
    # The tail stays where it is (0.3 m behind): nose down means that the middle sinks.
    result = await caller("cyberdog.motion.relatively_position_control_attitude", pitch=15, fulcrum_x=-0.3)
    assert field(result, "response.motion_id") == 212
    assert legs.body_height == pytest.approx(height - 0.3 * math.sin(math.radians(15)), abs=0.01)


@pytest.mark.parametrize(
    ("name", "kwargs"),
    [
        ("absolute_attitude", {"centroid_z": 0.31}),
        ("absolute_attitude", {"roll": 26}),
        ("absolute_attitude", {"pitch": math.nan}),
        ("absolute_attitude", {"duration": 7}),
        ("transition_standing", {"centroid_z": 0.05}),
        ("relatively_force_control_attitude", {"centroid_z": 0.21}),
        ("relatively_force_control_attitude", {"yaw": -52}),
        ("relatively_position_control_attitude", {"fulcrum_y": 0.6}),
        ("walk_the_dog", {"front_leg_lift": 0.2}),
        ("jump_back_and_forth", {"x_jump_velocity": 0.2}),
        ("small_jump_walking", {"z_jump_velocity": 29}),
    ],
)
async def test_values_outside_the_limits_move_no_leg(caller: Caller, name: str, kwargs: dict[str, float]) -> None:
    legs = caller.robot[Legs]
    before = (legs.body_height, legs.attitude, legs.gait)
    result = await caller(f"cyberdog.motion.{name}", **kwargs)
    assert field(result, "state.code") == 1
    assert field(result, "response").fields.items() >= REFUSED.items()
    assert (legs.body_height, legs.attitude, legs.gait) == before
    assert not caller.robot.actions.history


@pytest.mark.parametrize(
    ("name", "number", "gait"),
    [
        ("trot_walking", 303, Gait.TROT_SLOW),
        ("automatic_frequency_conversion_walking", 304, Gait.TROT_ADAPTIVE),
        ("run_fast_walking", 305, Gait.TROT_FAST),
        ("jump_back_and_forth", 301, Gait.BOUND),
        ("small_jump_walking", 302, Gait.PRONK),
    ],
)
async def test_each_walk_has_its_gait_and_foot_lift(
    caller: Caller, world: World, name: str, number: int, gait: Gait
) -> None:
    legs, before = caller.robot[Legs], world.truth.pose_of("a")
    walking = caller.start(f"cyberdog.motion.{name}", 0.15, front_leg_lift=0.05, back_leg_lift=0.06, duration=2)
    await caller.clock.advance(1.0)
    assert (legs.gait, legs.foot_lift) == (gait, FootLift(0.05, 0.06))
    await caller.clock.advance(2.5)
    assert field(walking.result(), "response.motion_id") == number
    assert_pose(world.truth.pose_of("a").relative_to(before), x=0.3, y=0.0, within=0.05)


async def test_a_gait_walks_no_faster_than_it_can(caller: Caller, world: World) -> None:
    before = world.truth.pose_of("a")
    await caller("cyberdog.motion.trot_walking", 1.2, duration=2)
    await caller.clock.advance(1.0)
    assert world.truth.pose_of("a").relative_to(before).x == pytest.approx(2 * GAITS[Gait.TROT_SLOW].highest.x, abs=0.2)


async def test_walking_on_a_leash_begins_standing(caller: Caller) -> None:
    legs = caller.robot[Legs]
    await caller("cyberdog.motion.get_down")
    result = await caller("cyberdog.motion.walk_the_dog", 0.04, 0.05)
    assert field(result, "response.motion_id") == 125
    assert (legs.posture, legs.gait, legs.foot_lift) == (Posture.STANDING, Gait.TROT_PASSIVE, FootLift(0.04, 0.05))


@pytest.mark.slow  # in short: test_walking_on_a_leash_begins_standing
async def test_dog_on_leash_goes_where_it_is_pulled(caller: Caller, world: World) -> None:
    legs = caller.robot[Legs]
    await off_the_dock(caller)
    before, start = world.truth.pose_of("a"), caller.clock.time()
    world.stage.pull("a", Point(15.0, 0.0))
    await caller.clock.advance(2.0)
    assert world.truth.pose_of("a").distance_to(before) < 0.02  # not on a leash, it stands
    world.stage.pull("a", Point())
    await caller("cyberdog.motion.walk_the_dog")
    assert caller.clock.time() - start < 4.0
    await caller.clock.advance(3.0)
    assert world.truth.pose_of("a").distance_to(before) < 0.02
    assert legs.gait is Gait.TROT_PASSIVE  # it waits
    ahead = Pose(before.x, before.y, before.yaw).compose(Pose(0.0, 1.0))  # to its left
    world.stage.pull("a", Point(10 * (ahead.x - before.x), 10 * (ahead.y - before.y)))
    await caller.clock.advance(3.0)
    way = world.truth.pose_of("a").relative_to(before)
    assert way.y > 0.5
    assert math.degrees(way.yaw) == pytest.approx(90, abs=15)
    world.stage.pull("a", Point(0.5, 0.5))
    await caller.clock.advance(2.0)
    held = world.truth.pose_of("a")
    await caller.clock.advance(1.0)
    assert world.truth.pose_of("a").distance_to(held) < 0.01
    world.stage.pull("a", Point(15.0, 0.0))
    caller.session.cancel("the end")
    await caller.clock.advance(2.0)
    assert legs.gait is not Gait.TROT_PASSIVE
    assert world.truth.pose_of("a").distance_to(held) < 0.1


class NearlyEmpty(Battery):
    @property
    def state(self) -> BatteryState:
        return BatteryState(0.15, 24.0, -1.0, 25.0, False, 1)


async def test_a_low_battery_spares_the_legs(caller: Caller) -> None:
    await off_the_dock(caller)
    caller.robot._components[Battery] = NearlyEmpty()
    assert field(await caller("cyberdog.motion.bow"), "response.code") == 3026
    assert caller.robot[Legs].performing is None
    assert field(await caller("cyberdog.motion.get_down"), "response.code") == 0


async def test_without_legs_nothing_is_performed(bare_caller: Caller) -> None:
    for name in ("back_flip", "absolute_attitude", "walk_the_dog"):
        assert field(await bare_caller(f"cyberdog.motion.{name}"), "response.code") == 3008
