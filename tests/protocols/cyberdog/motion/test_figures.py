"""Figures, gaits and body poses by number, on a simulated dog: time, place, posture, refusals."""

from __future__ import annotations

import asyncio
import itertools
import math

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.motion.motions import Motion
from roboglot.model.components.motion.motors import Motors
from roboglot.model.geometry import Pose
from roboglot.protocols.cyberdog.chapters.motion.motion_table import POSES
from roboglot.testing import assert_pose
from roboglot.wire.cyberdog.chapters.motion.motion import RELATIVE_SHIFT_MAX, RELATIVE_TURN_MAX
from tests.protocols.cyberdog.phone import App, Client, answered, until

pytestmark = pytest.mark.world("playground", body="cyberdog2")


@pytest.fixture(autouse=True)
async def middle(world, robot, forward):
    """The robot stands in the middle of the room, some time after its start."""
    world.stage.place("a", Pose(4.0, 2.5, 0.0))
    await forward(seconds=0.5)


@pytest.mark.parametrize(
    ("motion", "way", "seconds"),
    [
        (130, Pose(0.0, 0.0, math.pi / 2), 1.5),
        (133, Pose(0.3), 1.5),
        pytest.param(134, Pose(0.0, 0.2), 1.5, marks=pytest.mark.slow),
        pytest.param(121, Pose(-0.3), 8.0, marks=pytest.mark.slow),
        pytest.param(143, Pose(), 2.5, marks=pytest.mark.slow),
        pytest.param(141, Pose(), 7.5, marks=pytest.mark.slow),
        (506, Pose(-0.45), 1.9),
    ],
)
async def test_jumps_take_their_time_and_land_in_place(client, robot, world, forward, motion, way, seconds):
    before = world.truth.pose_of("a")
    answer = await answered(client, 1004, {"motion_id": motion}, forward)
    assert answer == {"motion_id": motion, "result": True, "code": 0}
    action = robot.actions.history[-1]
    assert seconds - 0.2 <= action.ended_at - action.started_at <= seconds + 1.0
    assert_pose(
        world.truth.pose_of("a").relative_to(before),
        x=way.x,
        y=way.y,
        deg=math.degrees(way.yaw),
        within=0.1,
        within_deg=9,
    )


async def test_sitting_figures_begin_with_sitting_down(client, robot, forward) -> None:
    asking = asyncio.ensure_future(client.ask(1004, {"motion_id": 150}))
    await until(lambda: robot.actions.running())
    await forward(seconds=1)
    assert robot[Legs].performing is Motion.SIT_DOWN
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 143
    assert (await client.ask(1004, {"motion_id": 133}))["code"] == 3011
    await forward(seconds=2)
    assert robot[Legs].performing is Motion.WAG
    await forward(seconds=2)
    assert await asking == {"motion_id": 150, "result": True, "code": 0}
    assert robot[Legs].posture is Posture.SITTING
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 143


async def test_dance_reports_timeout_and_lying_down_interrupts_it(client, robot, forward) -> None:
    asking = asyncio.ensure_future(client.ask(1004, {"motion_id": 140}))
    await until(lambda: robot.actions.running())
    await forward(seconds=5)
    assert (await client.ask(1004, {"motion_id": 111}))["code"] == 3011
    lying = await answered(client, 1004, {"motion_id": 101}, forward)
    assert lying["code"] == 0
    assert robot[Legs].posture is Posture.LYING
    assert (await asking)["code"] == 3001


async def test_a_lying_dog_gets_up_for_a_figure(client, robot, forward) -> None:
    robot[Legs].lie_down()
    await forward(seconds=5)
    assert (await answered(client, 1004, {"motion_id": 136}, forward))["code"] == 0
    assert robot[Legs].posture is Posture.STANDING


async def test_obstacle_before_a_figure_is_reported(client, robot, world, forward) -> None:
    world.stage.place("a", Pose(0.45, 4.0, math.pi))  # before the wall
    await forward(seconds=0.5)
    assert (await answered(client, 1004, {"motion_id": 132}, forward))["code"] == 3041


async def test_hot_motors_and_a_cable_allow_no_figures(client, robot, forward) -> None:
    robot[Motors].warm(99.0)
    assert (await client.ask(1004, {"motion_id": 121}))["code"] == 3033
    robot[Motors].warm(30.0)
    robot[Battery].plug(True)
    await forward(seconds=1)
    assert (await client.ask(1004, {"motion_id": 121}))["code"] == 3056
    robot[Battery].plug(False)
    robot[Battery].set_charge(0.15)
    assert (await client.ask(1004, {"motion_id": 121}))["code"] == 3013
    assert (await answered(client, 1004, {"motion_id": 212, "duration": 500}, forward))["code"] == 0


async def test_body_poses(client, robot, forward) -> None:
    pose = {"motion_id": 211, "rpy_des": [0, 0.2, 0], "pos_des": [0, 0, 0], "duration": 1000}
    assert (await answered(client, 1004, pose, forward))["code"] == 0
    assert robot[Legs].attitude.pitch == pytest.approx(0.2, abs=0.01)
    more = {"motion_id": 212, "rpy_des": [0.1, 0.0, 0.0], "duration": 1000}
    assert (await answered(client, 1004, more, forward))["code"] == 0
    assert robot[Legs].attitude.pitch == pytest.approx(0.2, abs=0.01)
    assert robot[Legs].attitude.roll == pytest.approx(0.1, abs=0.01)
    assert (await client.ask(1004, {**pose, "rpy_des": [0, 3, 0]}))["code"] == 3010
    assert (await client.ask(1004, {**pose, "duration": 0}))["code"] == 3010
    assert (await answered(client, 1004, {"motion_id": 201}, forward))["code"] == 0  # free: half a second
    assert robot[Legs].attitude.pitch == pytest.approx(0.0, abs=0.01)


async def test_a_pose_beyond_its_range_is_refused(client, robot, forward) -> None:
    """Every pose, on every axis."""
    limits, before = robot[Legs].limits, robot[Legs].attitude
    turns, shifts = [limits.angle] * 3, [limits.shift, limits.shift, limits.highest]
    for number, (relative, _) in POSES.items():
        most = {"rpy_des": [RELATIVE_TURN_MAX] * 3 if relative else turns}
        most["pos_des"] = list(RELATIVE_SHIFT_MAX) if relative else shifts
        for name, axis, sign in itertools.product(most, range(3), (1, -1)):
            for value in (1.001 * most[name][axis], 99.0):
                asked = {"motion_id": number, name: [sign * value if k == axis else 0.0 for k in range(3)]}
                answer = await client.ask(1004, {**asked, "duration": 500})
                assert answer == {"motion_id": number, "result": False, "code": 3010}, asked
    await forward(seconds=1)
    assert robot[Legs].attitude == before


async def test_servo_frames_choose_gait_pose_and_the_lift(client, robot, forward) -> None:
    walk = {"motion_id": 305, "vel_des": [0.4, 0, 0], "rpy_des": [0, 0.1, 0], "step_height": [0.06, 0.05]}
    for _ in range(6):
        await client.ask(1002, walk)
        await forward(seconds=0.1)
    assert robot[Legs].gait is Gait.TROT_FAST
    assert (robot[Legs].foot_lift.front, robot[Legs].foot_lift.rear) == (0.06, 0.05)
    assert robot[Legs].attitude.pitch == pytest.approx(0.1, abs=0.03)
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 305


@pytest.mark.slow
async def test_getting_up_for_a_servo_is_reported(client, app: App, robot, passing, forward) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    for _ in range(3):
        await client.ask(1002, {"motion_id": 303, "vel_des": [0, 0, 0.1]})
        await forward(seconds=0.1)
    robot[Legs].lie_down()
    await forward(seconds=6)
    count_before = len(app.of(1003))
    for _ in range(60):
        await client.ask(1002, {"motion_id": 303, "vel_des": [0, 0, 0.1]})
        await forward(seconds=0.1)
    await until(lambda: len(app.of(1003)) > count_before + 10)
    bars = [push["order_process_bar"] for push in app.of(1003)[count_before:]]
    assert bars == sorted(bars)
    assert bars[-1] == 100
    assert len(set(bars)) > 5


async def test_device_information_of_a_dog(client: Client, robot) -> None:
    answer = await client.ask(1001, {"is_motor_temper": True, "is_version": True})
    temperatures = answer["motor_temper"]
    assert {joint: len(legs) for joint, legs in temperatures.items()} == {"hip": 4, "thigh": 4, "crus": 4}
    assert temperatures["crus"][3] == pytest.approx(robot[Motors].temperatures["right rear knee"], abs=0.01)
    assert answer["version"]["new_version"] == "1.3.0.0"
    assert answer["version"]["nx_mcu"]["MCU_IMU"] == "1.0.9"
    assert answer["version"]["motors"] == {"MCU_Motor": "1.1.0"}
