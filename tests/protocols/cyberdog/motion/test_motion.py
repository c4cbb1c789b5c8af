"""Chapter "motion" through the door, on a simulated robot without lidar skills."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from roboglot.model.client_context import acting_for
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.lease import Lease
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.motion.gait import Gaits
from roboglot.protocols.cyberdog.chapters.motion.motion_start import MotionRequest
from roboglot.simulation.world.world import World
from roboglot.testing import assert_pose
from roboglot.wire.cyberdog.chapters.motion.motion import MotionCode
from tests.protocols.cyberdog.phone import App, Client, answered, until

WALK = {"motion_id": 303, "cmd_type": 1, "cmd_source": 0, "vel_des": [0.4, 0, 0]}


@pytest.fixture
def robot(walker: tuple[World, Robot]) -> Robot:
    return walker[1]


@pytest.fixture
def world(walker: tuple[World, Robot]) -> World:
    world, _ = walker
    world.stage.place("a", Pose(6.0, 10.0, 0.0))
    return world


async def test_servo_frames_walk_and_the_watchdog_stops(client, robot, world, forward) -> None:
    await forward(seconds=0.5)
    before = world.truth.pose_of("a")
    for _ in range(10):
        assert await client.ask(1002, WALK) == ""
        await forward(seconds=0.1)
    await forward(seconds=0.15)
    assert robot[Base].velocity.x > 0.3
    await forward(seconds=0.15)  # 300 ms after the last frame it brakes
    assert robot[Base].velocity.x < 0.38
    await forward(seconds=1)
    assert not robot.actions.running(BASE)
    assert robot[Base].velocity == Twist()
    moved = world.truth.pose_of("a").relative_to(before)
    assert 0.3 < moved.x < 0.6
    assert_pose(moved, y=0.0, deg=0.0)


async def test_integers_in_float_arrays_count(client, robot, world, forward) -> None:
    for _ in range(8):
        await client.ask(1002, {"motion_id": 303, "vel_des": [0, 0, 1]})
        await forward(seconds=0.1)
    assert robot[Base].velocity.yaw > 0.5
    assert world.truth.pose_of("a").yaw > 0.2


@pytest.mark.parametrize("velocity", [[0.4], [0.4, 0.0, 0.0, 0.0], "fast", [0.4, "0", None]])
async def test_invalid_velocity_moves_nothing(client, robot, world, forward, velocity) -> None:
    before = world.truth.pose_of("a")
    await client.ask(1002, {"motion_id": 303, "vel_des": velocity})
    await forward(seconds=0.15)
    assert world.truth.pose_of("a").distance_to(before) < 0.01


async def test_velocity_is_cut_to_the_walk(client, robot, world, forward) -> None:
    await client.ask(1002, {"motion_id": 303, "vel_des": [9.0, 0.0, 0.0]})
    (action,) = robot.actions.running(BASE)
    assert action.goal == Twist(0.6, 0.0, 0.0)


async def test_the_end_frame_stops_at_once(client, robot, world, forward) -> None:
    for _ in range(5):
        await client.ask(1002, WALK)
        await forward(seconds=0.1)
    await client.ask(1002, {"motion_id": 303, "cmd_type": 2})
    await forward(seconds=0.02)
    assert robot.actions.running(BASE) == [] or robot.actions.running(BASE)[0].status.name == "CANCELING"


@pytest.mark.slow  # in short: test_a_lying_dog_gets_up_for_a_figure
async def test_a_lying_robot_gets_up_before_it_walks(client, robot, world, forward) -> None:
    robot[Legs].lie_down()
    await forward(seconds=5)
    assert robot[Legs].posture is Posture.LYING
    before = world.truth.pose_of("a")
    for _ in range(60):
        await client.ask(1002, WALK)
        await forward(seconds=0.1)
    assert robot[Legs].posture is Posture.STANDING
    assert world.truth.pose_of("a").distance_to(before) > 0.3


async def test_every_frame_is_reported(
    client: Client, app: App, passing: Callable[..., Awaitable[None]], world: World
) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    await client.ask(1002, {**WALK, "cmd_id": 7})
    await until(lambda: app.of(1003))
    assert app.of(1003) == [
        {"motion_id": 303, "cmd_id": 7, "result": True, "code": 0, "status": 0, "order_process_bar": 100}
    ]
    await client.ask(1002, {"motion_id": 130, "vel_des": [0.1, 0.0, 0.0]})
    await until(lambda: len(app.of(1003)) == 2)
    assert app.of(1003)[1]["result"] is False
    assert app.of(1003)[1]["code"] == 3008
    assert "cmd_id" not in app.of(1003)[1]
    await client.ask(1002, {**WALK, "cmd_type": 3})  # neither data nor end
    await until(lambda: len(app.of(1003)) == 3)
    assert (app.of(1003)[2]["result"], app.of(1003)[2]["code"]) == (False, 3010)


async def test_lying_and_standing_are_answered_when_done(client, robot, world, forward) -> None:
    assert await answered(client, 1004, {"motion_id": 101, "duration": 0}, forward) == {
        "motion_id": 101,
        "result": True,
        "code": 0,
    }
    assert robot[Legs].posture is Posture.LYING
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 101
    assert (await answered(client, 1004, {"motion_id": 111}, forward))["result"] is True
    assert robot[Legs].posture is Posture.STANDING
    assert (await client.ask(10001))["motion_status"]["motion_id"] == 111


async def test_a_walk_with_a_duration(client, robot, world, forward) -> None:
    before = world.truth.pose_of("a")
    answer = await answered(client, 1004, {"motion_id": 308, "vel_des": [0.5, 0, 0], "duration": 2000}, forward)
    assert answer == {"motion_id": 308, "result": True, "code": 0}
    assert 0.7 < world.truth.pose_of("a").relative_to(before).x < 1.2
    assert robot[Base].velocity.speed < 0.05


@pytest.mark.slow  # in short: test_a_walk_with_a_duration
async def test_a_lying_robot_walks_its_whole_duration(client, robot, world, forward) -> None:
    robot[Legs].lie_down()
    await forward(seconds=5)
    before = world.truth.pose_of("a")
    assert (await answered(client, 1004, {"motion_id": 308, "vel_des": [0.5, 0, 0], "duration": 2000}, forward))[
        "result"
    ]
    assert world.truth.pose_of("a").distance_to(before) > 0.7


REFUSED: list[tuple[dict[str, object], int]] = [
    ({"motion_id": 180}, 3031),  # an empty place for a gait
    ({"motion_id": 121, "duration": 500}, 3010),
    ({"motion_id": 211, "rpy_des": [0, 0.1, 0]}, 3010),
    ({"motion_id": 99999}, 3008),
    ({"motion_id": 111, "duration": 500}, 3010),
    ({"motion_id": 303, "vel_des": [0.1, 0, 0]}, 3010),
    ({"motion_id": 303, "duration": -5}, 3010),
    ({"motion_id": 303, "duration": 2_000_000_000}, 3010),
]


async def test_refused_motions(client, robot, world) -> None:
    for params, code in REFUSED:
        assert await client.ask(1004, params) == {"motion_id": params["motion_id"], "result": False, "code": code}, (
            params
        )
        assert robot.actions.running() == [], params


async def test_a_motion_without_its_number_is_no_request(client, robot, world) -> None:
    assert await client.ask(1004, {"vel_des": [1, 0, 0]}) == {"error_code": 323}
    assert await client.ask(1004, {"motion_id": "111"}) == {"error_code": 323}
    assert await client.ask(1004, {"motion_id": 10**30}) == {"error_code": 323}


async def test_one_motion_at_a_time(client, robot, world, forward) -> None:
    lying = asyncio.ensure_future(client.ask(1004, {"motion_id": 101}))
    await until(lambda: robot.actions.running())
    assert (await client.ask(1004, {"motion_id": 111}))["code"] == 3011
    await forward(seconds=10)
    assert (await lying)["code"] == 0


@pytest.mark.parametrize("pause", [0.1, *(pytest.param(pause, marks=pytest.mark.slow) for pause in (0.0, 0.25))])
@pytest.mark.parametrize("then", [{"motion_id": 111}, {"motion_id": 101}, {"motion_id": 211, "duration": 300}])
async def test_a_motion_follows_own_servo_at_once(client, robot, world, forward, then, pause) -> None:
    for _ in range(8):
        await client.ask(1002, WALK)
        await forward(seconds=0.1)
    await forward(seconds=pause)
    assert (await answered(client, 1004, then, forward))["code"] == 0
    servo, followed = robot.actions.history[-2:]
    assert followed.ended_at - servo.ended_at < 2.0  # the motion's own duration
    assert robot[Base].velocity.speed < 0.01


@pytest.mark.slow  # in short: test_one_motion_at_a_time
async def test_frames_that_come_during_a_motion_are_refused(client, app, robot, world, forward, passing) -> None:
    await client.ask(1002, WALK)
    lying = asyncio.ensure_future(client.ask(1004, {"motion_id": 101}))
    await passing(lambda: app.connected and robot[Legs].posture is Posture.CHANGING)
    await client.ask(1002, WALK)
    await until(lambda: app.of(1003) and app.of(1003)[-1]["code"] == 3011)
    await forward(seconds=5)
    assert (await lying)["code"] == 0


async def test_another_clients_servo_is_not_cut_short(client, robot, world, forward) -> None:
    gaits = Gaits(robot)
    with acting_for("cyberdog 10.0.0.7"):
        gaits.servo(303, MotionRequest(Twist(0.3)))
    await forward(seconds=0.1)
    with acting_for("cyberdog 10.0.0.8"):
        assert gaits.check(111, MotionRequest()) is MotionCode.BUSY
    with acting_for("cyberdog 10.0.0.7"):
        assert gaits.check(111, MotionRequest()) is None


async def test_only_standing_leads_out_of_emergency_stop(client, robot, world, forward) -> None:
    walking = asyncio.ensure_future(client.ask(1004, {"motion_id": 308, "vel_des": [0.5, 0, 0], "duration": 9000}))
    await until(lambda: robot.actions.running())
    await forward(seconds=1)
    assert (await client.ask(1004, {"motion_id": 0}))["code"] == 0
    await forward(seconds=2)
    assert (await walking)["code"] == 3040
    assert robot[Legs].posture is Posture.LIMP
    assert (await client.ask(1004, {"motion_id": 101}))["code"] == 3040
    assert (await answered(client, 1004, {"motion_id": 111}, forward))["code"] == 0
    assert robot[Legs].posture is Posture.STANDING


@pytest.mark.parametrize(
    "motion",
    [
        {"motion_id": 111},
        pytest.param({"motion_id": 308, "vel_des": [0.5, 0, 0], "duration": 900}, marks=pytest.mark.slow),
    ],
)
async def test_emergency_stop_ends_a_motion_that_waits(client, robot, world, forward, motion) -> None:
    for _ in range(5):
        await client.ask(1002, WALK)
        await forward(seconds=0.1)
    waiting = asyncio.ensure_future(client.ask(1004, motion))  # for the brakes after the servo's frames
    await until(lambda: robot.actions.running(BASE)[0].status.name == "CANCELING")
    assert (await client.ask(1004, {"motion_id": 0}))["code"] == 0
    await forward(seconds=5)
    assert (await waiting)["code"] == 3040
    assert robot[Legs].posture is Posture.LIMP


@pytest.mark.slow  # in short: test_dance_reports_timeout_and_lying_down_interrupts_it
async def test_motion_longer_than_20_s_is_a_timeout(client, robot, world, forward) -> None:
    long = asyncio.ensure_future(client.ask(1004, {"motion_id": 303, "vel_des": [0, 0, 0.5], "duration": 30_000}))
    await until(lambda: robot.actions.running())
    await forward(seconds=21)
    assert await long == {"error_code": 321}
    assert robot.actions.running(BASE)  # the motion itself goes on


async def test_low_battery_allows_little(client, robot, world, forward) -> None:
    robot[Battery].set_charge(0.15)
    assert (await client.ask(1004, {"motion_id": 308, "duration": 500, "vel_des": [0.1, 0, 0]}))["code"] == 3013
    assert (await client.ask(10001))["state_switch_status"] == {"state": 1, "code": 0}
    robot[Battery].set_charge(0.04)
    assert (await client.ask(1004, {"motion_id": 308, "duration": 500, "vel_des": [0.1, 0, 0]}))["code"] == 3003
    assert (await answered(client, 1004, {"motion_id": 101}, forward))["code"] == 0


async def test_another_door_takes_over(client, robot, world, forward) -> None:
    walking = asyncio.ensure_future(client.ask(1004, {"motion_id": 308, "vel_des": [0.5, 0, 0], "duration": 9000}))
    await until(lambda: robot.actions.running())
    await forward(seconds=0.5)
    robot[Driving].drive(Twist(0.1), lifetime=1.0, source="another")
    await forward(seconds=2)
    assert (await walking)["code"] == 3001


async def test_device_information_has_the_requested_fields(client, robot, world) -> None:
    assert await client.ask(1001) == {"non-standing": False}
    answer = await client.ask(1001, {"is_sn": True, "is_bat_info": True, "is_wifi": True, "is_stand": 1, "uid": 3})
    assert answer.keys() == {"sn", "bat_info", "wifi", "non-standing"}
    assert answer["sn"] == robot.description.serial
    assert answer["bat_info"]["power"] == round(100 * robot[Battery].state.percentage)
    names = (
        "version sn nick_name volume mic_state voice_control wifi bat_info motor_temper audio_state device_model stand"
    )
    everything = await client.ask(1001, {f"is_{name}": True for name in (*names.split(), "lowpower_control")})
    assert len(everything) == 14
    assert everything["stand"] is True


async def test_no_tasks_and_no_map_without_lidar(client, robot, world) -> None:
    for task in (1, 5, 7, 9):
        assert await client.ask(6004, {"type": task, "goalX": 1, "goalY": 1}) == {"error_code": 322}
    assert await client.ask(6003) == {"error_code": 322}
    assert await client.ask(6002, {"mapName": "a"}) == {"error_code": 322}


async def test_client_without_control_learns_that_another_has_it(client, robot, forward) -> None:
    lease = robot.add(Lease, Lease(robot))
    await lease.take("robomaster")
    assert await client.ask(1004, {"motion_id": 101}) == {"motion_id": 101, "result": False, "code": 3001}
    await client.ask(1002, WALK)  # only pushes answer servo frames
    assert not robot.actions.running()
    await lease.take("cyberdog")
    assert await client.ask(1002, WALK) == ""
    await forward(seconds=0.1)
    assert lease.holder is not None
    assert lease.holder.who == "cyberdog 127.0.0.1"
