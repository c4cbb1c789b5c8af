"""cyberdog.motion on the simulated robot: what moves, by how much, and what is refused."""

from __future__ import annotations

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.lease import Lease
from roboglot.model.geometry import Pose, Twist
from roboglot.programs.functions.moving.performing import RESULT_MOTIONS
from roboglot.programs.functions.table import ABILITIES
from roboglot.simulation.world.world import World
from roboglot.testing import assert_pose
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("empty")
REFUSED = {"result": False, "code": 3010}


async def moved(caller: Caller, world: World, name: str, *args: object, **kwargs: object) -> Pose:
    """Return where the call took base_link, seen from where it was."""
    before = world.truth.pose_of("a")
    result = await caller(f"cyberdog.motion.{name}", *args, **kwargs)
    assert field(result, "state.code") == 0, result
    assert field(result, "response.result") is True
    await caller.clock.advance(0.5)
    return world.truth.pose_of("a").relative_to(before)


async def test_going_straight_by_distance_and_back_by_time(caller: Caller, world: World) -> None:
    assert_pose(await moved(caller, world, "go_straight", 0.3, 0.5), x=0.5, y=0.0, deg=0)
    assert_pose(await moved(caller, world, "go_straight", -0.25, 0, 2), x=-0.5, y=0.0, deg=0, within=0.08)
    assert_pose(await moved(caller, world, "go_straight", velocity=0.3, journey=0.2, time=0), x=0.2, y=0.0, deg=0)


async def test_left_is_positive(caller: Caller, world: World) -> None:
    assert_pose(await moved(caller, world, "lateral_movement", 0.3, 0.3), x=0.0, y=0.3, deg=0)
    assert_pose(await moved(caller, world, "lateral_movement", -0.3, 0.3), x=0.0, y=-0.3, deg=0)
    assert_pose(await moved(caller, world, "turn", 90), x=0.0, y=0.0, deg=90)
    assert_pose(await moved(caller, world, "turn", -45, 0), x=0.0, y=0.0, deg=-45)


async def test_turning_takes_the_time_it_is_given(caller: Caller) -> None:
    start = caller.clock.time()
    await caller("cyberdog.motion.turn", 60, 5)
    assert 4.9 < caller.clock.time() - start < 6.0


async def test_trotting_on_an_arc_by_distance(caller: Caller, world: World) -> None:
    end = await moved(caller, world, "trot_walking", 0.4, 0, 57.3, distance=0.4 * math.pi / 2)
    assert_pose(end, x=0.4, y=0.4, deg=90, within=0.1, within_deg=10)


async def test_trotting_for_time_in_both_directions_at_once(caller: Caller, world: World) -> None:
    assert_pose(await moved(caller, world, "trot_walking", 0.2, 0.1, duration=3), x=0.6, y=0.3, deg=0, within=0.08)


@pytest.mark.parametrize(
    ("walk", "motion"), [("automatic_frequency_conversion_walking", 304), ("run_fast_walking", 305)]
)
async def test_the_other_walks(caller: Caller, world: World, walk: str, motion: int) -> None:
    before = world.truth.pose_of("a")
    result = await caller(f"cyberdog.motion.{walk}", 0.5, distance=0.5)
    assert field(result, "response.motion_id") == motion
    await caller.clock.advance(0.5)
    assert_pose(world.truth.pose_of("a").relative_to(before), x=0.5, y=0.0)


async def test_neither_distance_nor_time_is_one_command(caller: Caller) -> None:
    start = caller.clock.time()
    await caller("cyberdog.motion.go_straight", 0.5, 0, 0)
    assert caller.clock.time() - start < 0.05
    [action] = caller.robot.actions.running(BASE)
    await caller.clock.advance(1.0)
    assert action.status is ActionStatus.SUCCEEDED


@pytest.mark.parametrize(
    ("name", "args"),
    [
        ("go_straight", (1.61, 1)),
        ("go_straight", (-1.7, 1)),
        ("go_straight", (0.3, 10.5)),
        ("go_straight", (0.3, -1)),
        ("go_straight", (0.3, 0, 3601)),
        ("go_straight", (math.nan, 1)),
        ("go_straight", (0.3, 0, math.inf)),
        ("go_straight", (0.0, 1)),
        ("lateral_movement", (1.3, 1)),
        ("turn", (360,)),
        ("turn", (-361,)),
        ("turn", (90, 6.5)),
        ("trot_walking", (0, 0, 115)),
        ("trot_walking", (0.1, 0, 0, 0.2)),
        ("trot_walking", (0.1, 0, 0, 0.03, 0.001)),
    ],
)
async def test_values_outside_the_limits_move_nothing(
    caller: Caller, world: World, name: str, args: tuple[float]
) -> None:
    before = world.truth.pose_of("a")
    result = await caller(f"cyberdog.motion.{name}", *args)
    assert field(result, "state.code") == 1
    assert field(result, "response").fields.items() >= REFUSED.items()
    assert field(await caller("cyberdog.motion.state"), "code") == 1
    assert not caller.robot.actions.running()
    assert not caller.robot.actions.history
    assert world.truth.pose_of("a") == before


# Just outside table 4.1, for every function with the parameter (durations of walks; relative positions, too).
BEYOND = {
    "centroid_x": (-0.401, 0.401),
    "centroid_y": (-0.301, 0.301),
    "centroid_z": (-0.201, 0.301),
    "roll": (-51.7, 51.7),
    "pitch": (-51.7, 51.7),
    "yaw": (-51.7, 51.7),
    "fulcrum_x": (-0.501, 0.501),
    "fulcrum_y": (-0.501, 0.501),
    "fulcrum_z": (-0.501, 0.501),
    "x_velocity": (-1.61, 1.61),
    "y_velocity": (-1.21, 1.21),
    "z_velocity": (-114.7, 114.7),
    "x_jump_velocity": (-0.26, 0.16),
    "y_jump_velocity": (-0.11, 0.11),
    "z_jump_velocity": (-28.7, 28.7),
    "front_leg_lift": (0.004, 0.101),
    "back_leg_lift": (0.004, 0.101),
    "distance": (-0.01, 10.01),
    "duration": (-0.1, 3601.0),
    "angle": (-360.1, 360.0),
}
WITHOUT_LIMITS = {"cyberdog.motion.run_sequence", "cyberdog.motion.set_log"}  # a sequence's: test_sequence_functions


@pytest.mark.world("empty", body="cyberdog2")
async def test_each_parameter_of_each_motion_has_its_limits(caller: Caller, world: World) -> None:
    before, tried = world.truth.pose_of("a"), 0
    for operation in ABILITIES:
        if not operation.key.startswith("cyberdog.motion.") or operation.key in WITHOUT_LIMITS:
            continue
        for parameter in operation.names:
            for value in (*BEYOND[parameter], math.nan):
                asked = (operation.key, parameter, value)
                result = await caller(operation.key, **{parameter: value})
                assert field(result, "state.code") == 1, asked
                assert field(result, "response").fields.items() >= REFUSED.items(), asked
                tried += 1
    assert tried == 3 * 69
    assert not caller.robot.actions.history
    assert world.truth.pose_of("a") == before


async def test_a_success_clears_the_groups_state(caller: Caller) -> None:
    await caller("cyberdog.motion.turn", 400)
    assert field(await caller("cyberdog.state"), "describe").startswith("motion: angle = 400 is outside")
    await caller("cyberdog.motion.turn", 10)
    assert field(await caller("cyberdog.state"), "code") == 0


async def test_lying_down_standing_up_and_going_limp(caller: Caller) -> None:
    legs = caller.robot[Legs]
    assert field(await caller("cyberdog.get_down"), "response.motion_id") == 101
    assert legs.posture is Posture.LYING
    assert field(await caller("cyberdog.motion.stand_up"), "response.motion_id") == 111
    assert legs.posture is Posture.STANDING
    assert field(await caller("cyberdog.motion.emergency_stop"), "response.result") is True
    assert legs.posture is Posture.LIMP
    walked = await caller("cyberdog.motion.go_straight", 0.3, 0.5)
    assert field(walked, "response.code") == 3040
    assert field(await caller("cyberdog.motion.get_down"), "response.code") == 3040
    assert legs.posture is Posture.LIMP
    await caller("cyberdog.motion.resume_standing")
    assert legs.posture is Posture.STANDING


async def test_limp_robot_only_stands_up(caller: Caller, world: World) -> None:
    legs, before = caller.robot[Legs], world.truth.pose_of("a")
    legs.go_limp()
    await caller.clock.advance(2.0)
    calls: list[tuple[str, tuple[float, ...]]] = [(name, ()) for name, _, _ in RESULT_MOTIONS]
    calls += [("walk_the_dog", ()), ("go_straight", (0.1, 0, 0)), ("trot_walking", (0.1,)), ("turn", (20,))]
    calls += [("absolute_attitude", (0.2, 5)), ("transition_standing", (0.2,)), ("get_down", ())]
    calls += [("relatively_force_control_attitude", (0.0, 0.0, 0.02)), ("jump_back_and_forth", (0.03,))]
    for name, arguments in calls:
        answer = await caller(f"cyberdog.motion.{name}", *arguments)
        assert (field(answer, "state.code"), field(answer, "response.code")) == (1, 3040), name
        assert legs.posture is Posture.LIMP, name
    await caller.clock.advance(5.0)
    assert world.truth.pose_of("a").distance_to(before) < 0.02
    assert field(await caller("cyberdog.motion.resume_standing"), "response.code") == 0


async def test_lying_robot_stands_up_to_walk(caller: Caller, world: World) -> None:
    await caller("cyberdog.motion.get_down")
    assert_pose(await moved(caller, world, "go_straight", 0.25, 0, 2), x=0.5, y=0.0, within=0.08)


async def test_pausing_holds_a_walk_and_its_time(caller: Caller, world: World) -> None:
    before = world.truth.pose_of("a")
    walking = caller.start("cyberdog.motion.go_straight", 0.25, 0, 4)
    await caller.clock.advance(2.0)
    caller.session.pause()
    await caller.clock.advance(1.0)
    held = world.truth.pose_of("a")
    await caller.clock.advance(30.0)
    assert world.truth.pose_of("a").distance_to(held) < 0.01
    assert not walking.done()
    caller.session.resume()
    await caller.clock.advance(3.0)
    assert field(walking.result(), "response.result") is True
    assert_pose(world.truth.pose_of("a").relative_to(before), x=1.0, y=0.0, within=0.1)


async def test_motion_that_begins_during_a_pause_waits(caller: Caller, world: World) -> None:
    before = world.truth.pose_of("a")
    caller.session.pause()
    move = caller.session.robot[Driving].move_by(Pose(0.5), source=caller.session.source)
    await caller.clock.advance(5.0)
    assert world.truth.pose_of("a").distance_to(before) < 0.01
    caller.session.resume()
    await caller.clock.advance(5.0)
    assert move.status is ActionStatus.SUCCEEDED
    assert_pose(world.truth.pose_of("a").relative_to(before), x=0.5, y=0.0)


async def test_takeover_of_the_base_is_reported(caller: Caller) -> None:
    walking = caller.start("cyberdog.motion.go_straight", 0.25, 0, 10)
    await caller.clock.advance(1.0)
    caller.robot[Driving].drive(Twist(), lifetime=0.1, source="someone")
    await caller.clock.advance(2.0)
    result = walking.result()
    assert (field(result, "state.code"), field(result, "response.code")) == (1, 3011)


async def test_a_cancelled_call_leaves_nothing_moving(caller: Caller) -> None:
    walking = caller.start("cyberdog.motion.trot_walking", 0.3, 0, 20, distance=5)
    await caller.clock.advance(1.0)
    walking.cancel()
    await caller.clock.advance(2.0)
    assert not caller.robot.actions.running()
    assert caller.robot[Base].velocity.speed < 0.01


async def test_a_robot_without_the_part_says_so(bare_caller: Caller) -> None:
    for name in ("get_down", "resume_standing", "go_straight"):
        result = await bare_caller(f"cyberdog.motion.{name}")
        assert (field(result, "state.code"), field(result, "response.code")) == (1, 3008), name


async def test_the_limits_can_be_read(caller: Caller) -> None:
    params = await caller("cyberdog.motion.params")
    assert field(params, "x_velocity.maximum_value") == 1.6
    assert field(params, "z_velocity.unit") == "deg/s"
    assert len(params.fields) == 17


@pytest.mark.parametrize(
    ("fault", "code"),
    [("low_battery", 3026), ("motor_fault", 3032), ("emergency_stop", 3040), ("brake_released", 3040)],
)
@pytest.mark.world("empty")
async def test_robot_s_trouble_is_reported_by_number(caller: Caller, world: World, fault: str, code: int) -> None:
    world.faults.inject(fault, "a")
    await caller.clock.advance(0.5)
    before = world.truth.pose_of("a")
    for call in (("turn", 20), ("go_straight", 0.2)):
        answer = await caller(f"cyberdog.motion.{call[0]}", *call[1:])
        assert (field(answer, "state.code"), field(answer, "response.code")) == (1, code)
    assert world.truth.pose_of("a").distance_to(before) < 0.01
    if fault == "low_battery":
        assert field(await caller("cyberdog.motion.get_down"), "response.code") == 0


async def test_a_program_without_control_learns_so(caller: Caller) -> None:
    robot = caller.session.robot
    await robot[Lease].take("robomaster")
    answer = await caller("cyberdog.motion.go_straight", 0.3, 0.1)
    assert field(answer, "response.code") == 3011
    assert not robot.actions.running(BASE)


async def test_wall_ends_a_walk_in_an_error_state(caller: Caller, world: World) -> None:
    world.stage.place("a", Pose(9.5, 5.0, 0.0))
    result = await caller("cyberdog.motion.go_straight", 0.3, 2.0)
    assert field(result, "state.code") != 0
    assert field(result, "response.result") is False
    assert caller.robot[Base].velocity == Twist()
    assert world.truth.pose_of("a").x == pytest.approx(9.75, abs=0.01)
    assert field(await caller("cyberdog.motion.go_straight", -0.3, 0.5), "state.code") == 0
