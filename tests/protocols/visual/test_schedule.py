"""Tasks that run at their time, on the robot's clock."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.client_context import acting_for
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.system import stopping
from roboglot.model.components.system.lease import PERSON, TEACHER, Lease
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState
from roboglot.programs.stores import StoredProgram
from roboglot.storage.database import Database
from roboglot.storage.programs import DatabaseProgramStore
from tests.protocols.visual.front_end import FrontEnd

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]
HELLO = "print('hello', time.strftime('%H:%M'))"
FOREVER = "time.sleep(1e6)"
MOVES = "print(cyberdog.motion.go_straight(0.3, 0.5).response.result)"
LOCKED = "the teacher has locked robot a"
STOPPED = "since it was stopped at the console, the robot waits for a command"


async def plan(app: FrontEnd, id: str, mode: str, condition: str, body: str = HELLO) -> None:
    """Save it and put it on the schedule."""
    assert (await app.save(id, body, mode=mode, condition=condition))["state"] == 0
    [answer] = await app.ask("run", id)
    assert answer["state"] == 0, answer


def starts(app: FrontEnd, id: str) -> int:
    return len(app.news(id, "start"))


@pytest.mark.parametrize(
    ("condition", "seconds", "printed"),
    [("now + 5minutes", 300, "00:05"), ("00:30", 1800, "00:30"), ("01:00 2026-01-02", 90_000, "01:00")],
)
async def test_a_single_task_runs_once_at_its_time(app: FrontEnd, condition: str, seconds: int, printed: str) -> None:
    await plan(app, "t", "single", condition)
    assert await app.state("t") == "run_wait"
    await app.clock.advance(seconds - 1)
    assert (await app.state("t"), starts(app, "t")) == ("run_wait", 0)
    await app.clock.advance(1)
    await app.ends("t", pace=0.0)
    assert (await app.state("t"), await app.printed("t")) == ("shutdown", [f"hello {printed}"])
    await app.clock.advance(2 * 86_400)
    assert starts(app, "t") == 1


async def test_cycle_repeats_until_it_is_removed(app: FrontEnd) -> None:
    await plan(app, "t", "cycle", "*/10 * * * *")
    for round in range(1, 4):
        await app.clock.advance(600)
        await app.until(lambda: len(app.news("t", "stop")) == round, pace=0.0)  # noqa: B023
        assert await app.state("t") == "run_wait"
    assert await app.printed("t") == ["hello 00:10", "hello 00:20", "hello 00:30"]
    assert (await app.ask("run", "t"))[0]["state"] == 27  # run_wait x run
    await app.ask("shutdown", "t")
    assert await app.state("t") == "shutdown"
    await app.clock.advance(3600)
    assert starts(app, "t") == 3


async def test_cycle_that_still_runs_is_not_started_twice(app: FrontEnd) -> None:
    await plan(app, "t", "cycle", "* * * * *", FOREVER)
    await app.clock.advance(60)
    await app.until(lambda: starts(app, "t"), pace=0.0)
    await app.clock.advance(60)
    await app.until(
        lambda: "second time" in "".join(entry.text for entry in app.service._runs["t"].log._entries), pace=0.0
    )
    assert starts(app, "t") == 1
    # The first shutdown ends the program, the second takes it off the schedule.
    await app.ask("shutdown", "t")
    assert await app.state("t") == "run_wait"
    assert any("second time" in entry.text for entry in await app.service.log("t"))
    await app.ask("shutdown", "t")
    assert await app.state("t") == "shutdown"


async def test_times_that_are_past_or_never_come(app: FrontEnd) -> None:
    for mode, condition in (("single", "00:01 2022-12-01"), ("cycle", "0 0 30 2 *")):
        assert (await app.save("t", HELLO, mode=mode, condition=condition))["state"] == 0
        assert (await app.ask("run", "t"))[0]["state"] == 27
        assert await app.state("t") == "wait_run"
    [answer] = await app.ask("run", "t", condition="now")  # the stored mode is cycle
    assert answer["state"] == 9
    [answer] = await app.ask("run", "t", mode="single", condition="now")
    assert answer["state"] == 0


async def test_new_condition_for_running_task_counts_next_time(app: FrontEnd) -> None:
    await app.start("t", FOREVER)
    assert (await app.ask("run", "t", mode="cycle", condition="0 * * * *"))[0]["state"] == 0
    assert (await app.state("t"), starts(app, "t")) == ("run", 1)
    await app.ask("shutdown", "t")
    assert await app.state("t") == "run_wait"
    await app.clock.advance(3600)
    await app.until(lambda: starts(app, "t") == 2, pace=0.0)


async def test_reboot_means_every_start_of_the_engine(connect: Connect, plain_robot: Robot, tmp_path: Path) -> None:
    database = Database(tmp_path / "robot.db")
    app = await connect(plain_robot, database)
    await plan(app, "t", "cycle", "@reboot")
    await app.clock.advance(86_400)
    assert (await app.state("t"), starts(app, "t")) == ("run_wait", 0)
    for _ in range(2):
        await app.door.close()
        app = await connect(plain_robot, database)
        await app.ends("t", pace=0.0)
        assert (await app.state("t"), starts(app, "t")) == ("run_wait", 1)
    await app.door.close()
    database.close()


async def test_the_schedule_survives_the_server(connect: Connect, plain_robot: Robot, tmp_path: Path) -> None:
    database = Database(tmp_path / "robot.db")
    app = await connect(plain_robot, database)
    await plan(app, "soon", "single", "now + 2hours")
    await plan(app, "late", "single", "now + 1hours")
    await plan(app, "again", "cycle", "30 * * * *")
    await plan(app, "never", "single", "now + 2hours")
    await app.ask("shutdown", "never")
    await app.door.close()
    await app.clock.advance(3601)  # in its absence: late by 1 s, one round of the cycle missed
    app = await connect(plain_robot, database)
    await app.ends("late", pace=0.0)
    assert await app.printed("late") == ["hello 01:00"]
    await app.clock.advance(3599)
    await app.ends("soon", pace=0.0)
    await app.ends("again", pace=0.0)
    assert (starts(app, "soon"), starts(app, "again"), starts(app, "late"), starts(app, "never")) == (1, 1, 1, 0)
    await app.door.close()
    database.close()


async def test_run_that_was_acknowledged_but_not_begun_begins(connect: Connect, plain_robot: Robot) -> None:
    database = Database(":memory:")
    store = DatabaseProgramStore(database, plain_robot.id)
    for id in ("t", "debug"):
        await store.put(StoredProgram(id, "", "", "single", "now", HELLO, "run_wait", due=1.0))
    app = await connect(plain_robot, database)
    await app.ends("t", pace=0.0)
    assert starts(app, "t") == 1
    assert starts(app, "debug") == 0
    await app.door.close()
    database.close()


async def test_forbidden_start_is_reported_at_its_time(app: FrontEnd, plain_robot: Robot) -> None:
    battery = Charge()
    plain_robot.add(Battery, battery)
    await plan(app, "once", "single", "now + 1minutes")
    await plan(app, "again", "cycle", "* * * * *")
    battery.charge = 0.04
    await app.clock.advance(60)
    await app.until(lambda: starts(app, "once") and starts(app, "again"), pace=0.0)
    assert [app.news(id, "start")[0]["feedback"]["state"] for id in ("once", "again")] == [27, 27]
    assert (await app.state("once"), await app.state("again")) == ("shutdown", "run_wait")
    assert "not started" in (await app.service.log("once"))[-1].text
    battery.charge = 1.0
    await app.clock.advance(60)
    await app.ends("again", pace=0.0)


async def test_ids_that_begin_alike_wait_for_themselves(app: FrontEnd) -> None:
    for id, condition in (("t1", "now + 1minutes"), ("t10", "now + 2minutes"), ("t", "now + 3minutes")):
        await plan(app, id, "single", condition, FOREVER)
    await app.clock.advance(120)
    await app.until(lambda: starts(app, "t1") and starts(app, "t10"), pace=0.0)
    await app.ask("shutdown", "t1")
    assert [await app.state(id) for id in ("t", "t1", "t10")] == ["run_wait", "shutdown", "run"]
    await app.ask("delete", "t1")
    assert [await app.state(id) for id in ("t", "t1", "t10")] == ["run_wait", "null", "run"]
    await app.ask("suspend", "t10")
    await app.ask("shutdown", "t")
    assert [await app.state(id) for id in ("t", "t10")] == ["shutdown", "suspend"]


class Charge(Battery):
    charge = 1.0

    @property
    def state(self) -> BatteryState:
        return BatteryState(self.charge, 24.0, -1.0, 25.0, False, 1)


async def test_locked_robot_starts_no_program(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await app.start("held", "time.sleep(1e6)")
    await app.ask("suspend", "held")
    assert (await app.save("t", MOVES))["state"] == 0
    await robot[Lease].take(TEACHER)
    frame = {"mode": "single", "condition": "now", "body": MOVES}
    for [answer] in (
        await app.ask("run", "t"),
        await app.ask("debug", "debug", **frame),
        await app.ask("recover", "held"),
    ):
        assert (answer["state"], answer["describe"]) == (27, LOCKED)
    assert (await app.state("t"), await app.state("held")) == ("wait_run", "suspend")
    assert (await app.ask("shutdown", "held"))[0]["state"] == 0
    await robot[Lease].release()
    await app.clock.advance(10.0)
    assert not app.news("t", "start")
    await app.start("t", MOVES)
    await app.ends("t", pace=0.2)
    assert await app.printed("t") == ["True"]


async def test_control_of_others_starts_programs(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    await robot[Lease].take(PERSON)
    await app.start("t", "print('hello')")
    await app.ends("t")
    assert await app.printed("t") == ["hello"]


@pytest.mark.parametrize(("mode", "condition"), [("single", "now + 1minutes"), ("cycle", "* * * * *")])
@pytest.mark.parametrize("why", [LOCKED, STOPPED, "the emergency stop holds the robot"])
async def test_schedule_skips_robots_that_are_held(
    connect: Connect, robot: Robot, mode: str, condition: str, why: str
) -> None:
    app = await connect(robot)
    await plan(app, "t", mode, condition, MOVES)
    match why:
        case _ if why == LOCKED:
            await robot[Lease].take(TEACHER)
        case _ if why == STOPPED:
            await stopping.stop(robot, reason="stopped at the console", moving=True)
        case _:
            robot[EmergencyStop].engage()
    await app.clock.advance(60.0)
    await app.until(lambda: app.news("t", "start"), pace=0.0)
    [report] = app.news("t", "start")
    assert (report["feedback"]["state"], report["feedback"]["describe"]) == (27, why)
    assert await app.state("t") == ("run_wait" if mode == "cycle" else "shutdown")
    assert [entry.text for entry in await app.service.log("t")] == [f"not started at its time: {why}"]
    await robot[Lease].release()
    robot[EmergencyStop].release()
    await app.clock.advance(30.0)
    assert not robot.actions.running()
    if mode == "cycle":
        await app.clock.advance(30.0)
        await app.ends("t", pace=0.2)
        assert await app.printed("t") == ["True"]


@pytest.mark.parametrize("command", ["drive", "run", "debug"])
async def test_schedule_goes_on_after_a_command(connect: Connect, robot: Robot, command: str) -> None:
    app = await connect(robot)
    await plan(app, "t", "cycle", "* * * * *", MOVES)
    await stopping.stop(robot, reason="stopped at the console", moving=True)
    robot[Driving].drive(Twist(), lifetime=0.1, source="pad")  # the robot itself, and no motion
    assert robot[Lease].stopped
    match command:
        case "drive":
            with acting_for("robomaster 10.0.0.5"):
                robot[Driving].drive(Twist(x=0.1), lifetime=0.2, source="pad")
        case "run":
            await app.start("other", "print('hello')")
        case _:
            await app.ask("debug", "debug", mode="single", condition="now", body="print('hello')")
    await app.clock.advance(60.0)
    await app.ends("t", pace=0.2)
    assert await app.printed("t") == ["True"]
