"""Programs as the vendor's app writes them, on the simulated robot, through frames."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.firmware import Firmware, Module
from roboglot.model.components.system.lease import Lease
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import assert_pose
from tests.protocols.visual.front_end import FrontEnd

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]

# It waits between its walks: a restart refuses these at once, and asking again would take a processor for 3 or 8 s.
WALK = """
while True:
    cyberdog.motion.go_straight(0.2, 0.5)
    cyberdog.motion.go_straight(-0.2, 0.5)
    time.sleep(0.1)
"""
SQUARE = """
cyberdog.task.block('stand~1');
cyberdog.motion.resume_standing();
n = 0
while true:
    cyberdog.task.block('walk`2');
    cyberdog.motion.go_straight(0.3, 0.4, 0);
    cyberdog.task.block('turn|3');
    if cyberdog.motion.turn(90, 1).state.code == StateCode.success:
        n += 1
    if n >= 4:
        break
cyberdog.task.block('say;4');
print('电量', cyberdog.bms.data.batt_soc > 20, n);
"""


async def test_an_app_like_program_drives_a_square(connect: Connect, robot: Robot, world: World) -> None:
    app = await connect(robot)
    before = world.truth.pose_of("a")
    await app.start("mi_1_saveTaskOrModule", SQUARE)
    await app.ends("mi_1_saveTaskOrModule", pace=0.2)
    assert await app.printed("mi_1_saveTaskOrModule") == ["电量 True 4"]
    assert_pose(world.truth.pose_of("a").relative_to(before), x=0.0, y=0.0, deg=0, within=0.15, within_deg=8)
    blocks = app.blocks("mi_1_saveTaskOrModule")
    assert [kind for kind, _ in blocks] == ["begin", "end"] * 10
    assert [id for kind, id in blocks if kind == "begin"] == ["stand~1", *["walk`2", "turn|3"] * 4, "say;4"]


@pytest.mark.slow  # in short: test_pausing_holds_a_motion
async def test_suspend_stops_the_robot_and_recover_goes_on(connect: Connect, robot: Robot, world: World) -> None:
    app = await connect(robot)
    before = world.truth.pose_of("a")
    await app.start("t", "cyberdog.motion.go_straight(0.25, 1.0)\nprint('there')\n")
    await app.until(lambda: robot[Base].velocity.speed > 0.2)
    await app.ask("suspend", "t")
    await app.clock.advance(1.5)
    held = world.truth.pose_of("a")
    assert 0.02 < held.distance_to(before) < 0.7
    await app.clock.advance(60.0)
    assert world.truth.pose_of("a").distance_to(held) < 0.01
    assert await app.state("t") == "suspend"
    await app.ask("recover", "t")
    await app.ends("t", pace=0.2)
    assert_pose(world.truth.pose_of("a").relative_to(before), x=1.0, y=0.0)
    assert await app.printed("t") == ["there"]


async def test_shutdown_stops_the_robot(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await app.start("t", "cyberdog.motion.go_straight(0.25, 0, 1000)\n")
    await app.until(lambda: robot[Base].velocity.speed > 0.2)
    await app.ask("shutdown", "t")
    assert await app.state("t") == "shutdown"
    await app.clock.advance(1.0)
    assert robot[Base].velocity.speed < 0.01
    assert not robot.actions.running()


async def test_a_program_that_ends_leaves_nothing_moving(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await app.start("t", "while true:\n    cyberdog.motion.go_straight(0.25, 0, 0)\n    cyberdog.motion.turn('x')\n")
    await app.ends("t")
    assert app.news("t", "run")[-1]["feedback"]["state"] == 26
    await app.clock.advance(1.0)
    assert not robot.actions.running()


async def test_cyberdog_shutdown_ends_the_program_in_good_order(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await app.start("t", "cyberdog.task.block('a')\ncyberdog.get_down()\ncyberdog.shutdown()\nprint('never')\n")
    await app.ends("t", pace=0.2)
    assert robot[Legs].posture is Posture.LYING
    assert app.blocks("t") == [("begin", "a"), ("end", "a")]
    assert all(frame["feedback"]["state"] == 0 for frame in app.frames)
    assert await app.printed("t") == []


async def test_a_program_without_control_reports_failure(connect: Connect, robot: Robot, world: World) -> None:
    app = await connect(robot)
    before = world.truth.pose_of("a")
    taking = asyncio.ensure_future(robot[Lease].take("robomaster"))
    await app.until(taking.done)
    await app.start("t", "for i in range(3):\n    cyberdog.motion.go_straight(0.25, 1.0)\nprint('there')\n")
    await app.ends("t")
    words = "3 motions were not carried out: control is taken by robomaster"
    assert [(frame["feedback"]["state"], frame["feedback"]["describe"]) for frame in app.news("t", "run")] == [
        (26, words)
    ]
    errors = [entry.text for entry in await app.service.log("t") if entry.level == "error"]
    assert errors[0].endswith("was not carried out: control is taken by robomaster")
    assert errors[1:] == [words]
    assert world.truth.pose_of("a").distance_to(before) < 0.02


async def test_control_taken_during_a_motion_is_reported(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await app.start("t", "cyberdog.motion.go_straight(0.25, 1.0)\n")
    await app.until(lambda: robot[Base].velocity.speed > 0.2)
    taking = asyncio.ensure_future(robot[Lease].take())
    await app.ends("t")
    await taking
    (frame,) = app.news("t", "run")
    assert frame["feedback"]["describe"] == "1 motion was not carried out: a person took control"


async def test_start_of_suspended_task_names_the_way_out(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await app.start("t", "time.sleep(100)\n")
    await app.ask("suspend", "t")
    (answer,) = await app.ask("run", "t")
    assert answer["state"] == 27
    assert "Recover it to go on, or shut it down first." in answer["describe"]


async def test_save_of_waiting_task_names_the_way_out(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    assert (await app.save("t", "print(1)\n", mode="cycle", condition="30 21 * * *"))["state"] == 0
    await app.ask("run", "t")
    answer = await app.save("t", "print(2)\n")
    assert answer["state"] == 27
    assert answer["describe"].endswith("t is in run_wait. It waits for its time: shut it down first.")


ENDLESS = """
while True:
    cyberdog.motion.go_straight(0.4, 0, 0)
"""
POLLING = """
calls, began = 0, time.monotonic()
while time.monotonic() < began + 1:
    calls += 1
print(calls)
"""


@pytest.mark.slow  # in short: test_polling_program_ends_in_lockstep
async def test_endless_calls_let_lockstep_time_pass(connect: Connect, robot: Robot, world: World) -> None:
    """A call that waits for nothing takes a millisecond, as on a real robot, or time would stand."""
    app = await connect(robot)
    before = world.truth.pose_of("a")
    await app.start("t", ENDLESS)
    await app.clock.advance(1.0)
    assert world.truth.pose_of("a").distance_to(before) > 0.2
    await app.ask("shutdown", "t")


async def test_polling_program_ends_in_lockstep(app: FrontEnd) -> None:
    await app.start("t", POLLING)
    await app.ends("t", pace=0.5)
    assert await app.printed("t") == ["999"]  # and one before the loop


@pytest.mark.parametrize("module", [Module.BASE, pytest.param(Module.SOFTWARE, marks=pytest.mark.slow)])
async def test_stop_during_a_restart_ends_the_program(
    connect: Connect, robot: Robot, world: World, module: Module
) -> None:
    app = await connect(robot)
    await app.start("t", WALK)
    await app.until(lambda: robot[Base].velocity.speed > 0.1)
    robot[Firmware].restart(module)
    await app.clock.advance(1.0)
    held = world.truth.pose_of("a")
    [answer] = await app.ask("shutdown", "t")
    assert answer["state"] == 27
    assert answer["describe"].endswith("It is carried out as soon as the module is up again.")
    await app.clock.advance(12.0)
    assert await app.state("t") == "shutdown"
    assert world.truth.pose_of("a").distance_to(held) < 0.02


async def test_stop_holds_when_the_restart_is_called_off(connect: Connect, robot: Robot, world: World) -> None:
    app = await connect(robot)
    await app.start("t", WALK)
    await app.until(lambda: robot[Base].velocity.speed > 0.1)
    restart = robot[Firmware].restart(Module.SOFTWARE)
    await app.clock.advance(1.0)
    held = world.truth.pose_of("a")
    await app.ask("shutdown", "t")
    restart.cancel("called off")
    await app.clock.advance(12.0)
    assert await app.state("t") == "shutdown"
    assert world.truth.pose_of("a").distance_to(held) < 0.02


@pytest.mark.slow  # in short: test_stop_holds_when_the_restart_is_called_off
async def test_suspended_during_a_restart_waits_for_recovery(connect: Connect, robot: Robot, world: World) -> None:
    app = await connect(robot)
    await app.start("t", WALK)
    await app.until(lambda: robot[Base].velocity.speed > 0.1)
    robot[Firmware].restart(Module.BASE)
    await app.clock.advance(1.0)
    held = world.truth.pose_of("a")
    await app.ask("suspend", "t")
    await app.clock.advance(12.0)
    assert await app.state("t") == "suspend"
    assert world.truth.pose_of("a").distance_to(held) < 0.02
    await app.ask("recover", "t")
    await app.until(lambda: robot[Base].velocity.speed > 0.1)


async def test_teacher_ends_programs_that_a_restart_holds(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await app.start("t", WALK)
    await app.until(lambda: robot[Base].velocity.speed > 0.1)
    robot[Firmware].restart(Module.BASE)
    await app.clock.advance(1.0)
    assert list(await app.service.shutdown(["t"], why="ended by the teacher")) == ["t"]
    await app.clock.advance(10.0)
    assert (await app.service.log("t"))[-1].text == "ended by the teacher"
