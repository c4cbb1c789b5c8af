"""Frames of tasks: what each operation answers, what tasks report by themselves, and what survives."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from front_end import FrontEnd
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.model.components.battery import Battery
from roboglot.model.components.map_library import Label, MapLibrary, StoredMap
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState
from roboglot.programs.tasks import TaskOperation, TaskState, next_state
from roboglot.storage.database import Database
from roboglot.storage.programs import LogEntry, ProgramStore, StoredProgram

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]
BUSY = "while True:\n    pass\n"
FOREVER = "time.sleep(100000)\n"


async def test_the_life_of_a_task_as_the_app_sees_it(app: FrontEnd) -> None:
    body = """
cyberdog.task.block('M2S3v;kdaZ`r~Ox55ZF9');
print('one', 2);
cyberdog.task.block('第二块');
time.sleep(5);
"""
    await app.start("mi_1_saveTaskOrModule", body)
    await app.ends("mi_1_saveTaskOrModule")
    feedbacks = [frame["feedback"] for frame in app.frames]
    assert [(f["operate"], f["state"], f["describe"]) for f in feedbacks] == [
        ("save", 0, "save task"),
        ("run", 0, "run task"),
        ("start", 0, "start task"),
        *[("run", 0, "run task")] * 4,
        ("stop", 0, "stop task"),
    ]
    assert app.blocks("mi_1_saveTaskOrModule") == [
        ("begin", "M2S3v;kdaZ`r~Ox55ZF9"),
        ("end", "M2S3v;kdaZ`r~Ox55ZF9"),
        ("begin", "第二块"),
        ("end", "第二块"),
    ]
    assert {f["target_id"] for f in feedbacks} == {"mi_1_saveTaskOrModule"}
    assert await app.state("mi_1_saveTaskOrModule") == "shutdown"
    assert await app.printed("mi_1_saveTaskOrModule") == ["one 2"]


async def test_the_list_gives_back_what_was_saved_but_not_the_body(app: FrontEnd) -> None:
    style = '{"blocks":{"languageVersion":0}}'
    await app.save("t10", "pass", describe="十", style=style, mode="cycle", condition="02 15 * * 1,5,7")
    await app.save("t1", "pass")
    [everything] = await app.ask("inquiry")
    assert [item["id"] for item in everything["list"]] == ["t1", "t10"]
    assert everything["list"][1] == {
        "id": "t10",
        "describe": "十",
        "style": style,
        "operate": "wait_run",
        "mode": "cycle",
        "condition": "02 15 * * 1,5,7",
        "dependent": [],
        "be_depended": [],
    }
    [one] = await app.ask("inquiry", "t1", "unknown")
    assert [item["id"] for item in one["list"]] == ["t1"]


async def test_a_wrong_body_is_kept_as_an_error_and_says_where(app: FrontEnd) -> None:
    answer = await app.save("t", "x = 1\ncyberdog.motion.trun(90)\n")
    assert answer["state"] == 23
    assert "line 2" in answer["describe"]
    assert "'turn'" in answer["describe"]
    assert await app.state("t") == "error"
    [answer] = await app.ask("run", "t")
    assert answer["state"] == 27
    assert (await app.save("t", "x = 1"))["state"] == 0


async def test_what_the_manual_has_and_the_robot_has_not_is_an_error_of_the_program(app: FrontEnd) -> None:
    await app.start("t", "try:\n    cyberdog.led.freed(1)\nexcept NotImplementedError as error:\n    print(error)\n")
    await app.ends("t")
    assert await app.printed("t") == ["cyberdog.led.freed is not built yet"]


async def test_an_uncaught_error_ends_the_task_and_is_told(app: FrontEnd) -> None:
    await app.start("t", "cyberdog.task.block('a')\nd = {}\nd['厨房']\n")
    await app.ends("t")
    error, block_end = app.news("t", "run")[1:]
    assert error["feedback"]["state"] == 26
    assert error["feedback"]["describe"] == "KeyError: '厨房' (line 3: d['厨房'])"
    assert block_end["block"] == {"type": "end", "id": "a"}
    assert await app.state("t") == "shutdown"
    assert (await app.service.log("t"))[-1].level == "error"


async def test_texts_that_utf8_cannot_hold_are_told_and_logged(app: FrontEnd) -> None:
    await app.start("t", "print('a\\ud800b')\nraise ValueError('\\udfff' * 10)\n")
    await app.ends("t")
    assert app.news("t", "run")[0]["feedback"]["describe"].startswith("ValueError: ??????????")
    assert await app.printed("t") == ["a?b"]


async def test_suspend_recover_and_shutdown_of_a_busy_loop(app: FrontEnd) -> None:
    await app.start("t", "n = 0\nwhile True:\n    n += 1\n")
    run = app.service._runs["t"]._run
    assert [a["state"] for a in await app.ask("suspend", "t")] == [0]
    assert app.news("t", "suspend")[0]["feedback"]["describe"] == "Task loop feedback, now state is suspend"
    assert process_state(run.pid) == "T"
    assert await app.state("t") == "suspend"
    await app.ask("suspend", "t")
    assert len(app.news("t", "suspend")) == 2
    await app.ask("recover", "t")
    assert process_state(run.pid) in "RS"
    assert app.news("t", "recover")[0]["feedback"]["describe"] == "Task loop feedback, now state is run"
    await app.ask("shutdown", "t")
    assert not alive(run.pid)
    assert app.news("t", "shutdown")[0]["feedback"]["describe"] == "Task loop feedback, now state is shutdown"
    assert await app.state("t") == "shutdown"
    assert app.news("t", "stop") == []


async def test_the_first_feedback_comes_before_the_second(app: FrontEnd) -> None:
    await app.start("t", BUSY)
    before = len(app.frames)
    await app.ask("suspend", "t")
    first, second = (frame["feedback"] for frame in app.frames[before:])
    assert not first["id"].startswith("task_")
    assert second["id"].startswith("task_")


async def test_a_suspended_sleep_sleeps_on_afterwards(app: FrontEnd) -> None:
    await app.start("t", "time.sleep(10)\nprint(time.monotonic())\n")
    await app.until(lambda: app.clock.time() >= 4.0)
    await app.ask("suspend", "t")
    await app.clock.advance(1000)
    assert await app.state("t") == "suspend"
    await app.ask("recover", "t")
    await app.ends("t")
    [woke] = await app.printed("t")
    assert 1009.0 < float(woke) < 1012.0


async def test_a_breakpoint_holds_until_recover(app: FrontEnd) -> None:
    await app.start("t", "print('a')\ncyberdog.task.breakpoint_block('b1')\nprint('b')\n")
    await app.until(lambda: app.news("t", "suspend"))
    assert app.blocks("t") == [("begin", "b1")]
    assert await app.printed("t") == ["a"]
    assert await app.state("t") == "suspend"
    await app.ask("recover", "t")
    await app.ends("t")
    assert await app.printed("t") == ["a", "b"]


async def test_several_targets_each_get_their_second_feedback(app: FrontEnd) -> None:
    for id in ("t1", "t10"):
        await app.start(id, BUSY)
    answers = await app.ask("suspend", "t1", "nobody", "t10")
    assert [(a["target_id"], a["state"]) for a in answers] == [("nobody", 27), ("t1", 0)]
    assert len(app.news("t1", "suspend")) == len(app.news("t10", "suspend")) == 1
    await app.ask("shutdown", "t1")
    assert (await app.state("t1"), await app.state("t10")) == ("shutdown", "suspend")


async def test_delete_answers_per_target_and_minds_similar_ids(app: FrontEnd) -> None:
    for id in ("t1", "t10", "t2"):
        await app.save(id, "pass")
    await app.start("t2", BUSY)
    answers = await app.ask("delete", "t1", "t2", "nobody")
    assert [(a["target_id"], a["state"]) for a in answers] == [("t1", 0), ("t2", 27), ("nobody", 0)]
    assert [await app.state(id) for id in ("t1", "t10", "t2")] == ["null", "wait_run", "run"]


async def test_running_a_running_task_starts_no_second_one(app: FrontEnd) -> None:
    await app.start("t", BUSY)
    pid = app.service._runs["t"]._run.pid
    [answer] = await app.ask("run", "t", mode="single", condition="21:30")
    assert answer["state"] == 0
    assert (len(app.news("t", "start")), app.service._runs["t"]._run.pid) == (1, pid)
    [listed] = await app.ask("inquiry", "t")
    assert (listed["list"][0]["condition"], listed["list"][0]["operate"]) == ("21:30", "run")


async def test_debug_runs_at_once_replaces_itself_and_is_not_listed(app: FrontEnd) -> None:
    fields = {"mode": "single", "condition": "now"}
    [answer] = await app.ask("debug", "debug", body=f"print(1)\n{BUSY}", **fields)
    assert answer["state"] == 0
    await app.until(lambda: app.news("debug", "start"))
    first = app.service._runs["debug"]._run.pid
    await app.ask("debug", "debug", body="print(2)", **fields)
    await app.ends("debug")
    assert not alive(first)
    assert (await app.printed("debug"))[-1] == "2"
    assert (await app.ask("inquiry"))[0]["list"] == []
    [answer] = await app.ask("debug", "debug", body="if", **fields)
    assert answer["state"] == 23


@pytest.mark.parametrize(
    ("mode", "condition"), [("cycle", "* * * * *"), ("single", "21:30"), ("single", "now + 1days")]
)
async def test_what_the_schedule_would_run_is_refused_and_stays_saved(app: FrontEnd, mode: str, condition: str) -> None:
    await app.save("t", "pass", mode=mode, condition=condition)
    [answer] = await app.ask("run", "t")
    assert answer["state"] == 29
    assert "not built" in answer["describe"]
    assert await app.state("t") == "wait_run"
    [answer] = await app.ask("run", "t", condition="not a time")
    assert answer["state"] == 9
    [answer] = await app.ask("run", "t", mode="single", condition="now")
    assert answer["state"] == 0


async def test_the_robots_mode_refuses_in_the_vendors_words(app: FrontEnd, plain_robot: Robot) -> None:
    battery = plain_robot.add(Battery, Charge())
    await app.start("t", BUSY)
    battery.charge = 0.04
    [answer] = await app.ask("recover", "t")
    words = "The current robot is in [LowPower] mode and does not support <recover> operation."
    assert (answer["state"], answer["describe"]) == (27, words)
    assert [(await app.ask("suspend", "t"))[0]["state"], (await app.ask("shutdown", "t"))[0]["state"]] == [0, 0]
    assert (await app.ask("run", "t"))[0]["state"] == 27


class Charge(Battery):
    charge = 1.0

    @property
    def state(self) -> BatteryState:
        return BatteryState(self.charge, 24.0, -1.0, 25.0, False, 1)


PREPARATIONS: dict[TaskState, list[tuple[str, str]]] = {
    TaskState.NULL: [],
    TaskState.ERROR: [("save", "if")],
    TaskState.WAIT_RUN: [("save", BUSY)],
    TaskState.RUN: [("save", BUSY), ("run", "")],
    TaskState.SUSPEND: [("save", BUSY), ("run", ""), ("suspend", "")],
    TaskState.SHUTDOWN: [("save", BUSY), ("run", ""), ("shutdown", "")],
}
USER_OPERATIONS = [operation for operation in TaskOperation if operation not in ("start", "stop", "debug")]


@pytest.mark.parametrize("state", PREPARATIONS)
async def test_frames_do_what_the_table_says(app: FrontEnd, state: TaskState) -> None:
    """run_wait is left out: without a schedule it lasts no longer than a process takes to start."""

    async def do(operation: str, body: str) -> Any:
        fields = {"mode": "single", "condition": "now", "body": body} if operation == "save" else {}
        [answer] = await app.ask(operation, "t", **fields)
        if operation == "run" and answer["state"] == 0:
            await app.until(lambda: app.news("t", "start"))
        return answer

    for operation in USER_OPERATIONS:
        for preparation in PREPARATIONS[state]:
            await do(*preparation)
        assert await app.state("t") == state
        expected = next_state(state, operation)
        answer = await do(operation, BUSY)
        assert answer.get("state", 0) == (27 if expected is None else 0), operation
        after = await app.state("t")
        assert after == (state if expected is None else "run" if expected == "run_wait" else expected), operation
        for cleaning in ("shutdown", "delete"):
            await app.ask(cleaning, "t")
        app.frames.clear()


async def test_frames_that_are_none(app: FrontEnd) -> None:
    await app.door.receive("{")
    assert app.frames[-1] == {
        "feedback": {
            "type": "parse",
            "id": "",
            "target_id": "",
            "operate": "",
            "state": 1,
            "describe": app.frames[-1]["feedback"]["describe"],
        }
    }
    [answer] = await app.ask("save", "../x", mode="single", condition="now", body="pass")
    assert (answer["state"], answer["type"], answer["target_id"]) == (4, "task", "../x")


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow], deadline=None, max_examples=60
)
@given(
    st.text(max_size=40)
    | st.fixed_dictionaries(
        {},
        optional={
            "type": st.sampled_from(["task", "module", "AI", "SLAM"]) | st.text(max_size=3),
            "id": st.text(max_size=5),
            "operate": st.sampled_from([*TaskOperation, "add"]),
            "target_id": st.lists(st.sampled_from(["t", "debug", "", "../x"]), max_size=3),
            "mode": st.sampled_from(["single", "cycle", "common", "map", "all", ""]),
            "condition": st.sampled_from(["now", "21:30", "f()", "* * * * *", ""]),
            "body": st.sampled_from(["pass", "if", "", "é"]) | st.integers(),
        },
    ).map(json.dumps)
)
def test_every_frame_gets_an_answer(text: str) -> None:
    async def ask() -> None:
        """With a service that runs nothing: this is about frames."""
        door = FrontEndOnly()
        await door.receive(text)
        assert door.sent
        for sent in door.sent:
            [key] = set(json.loads(sent)) - {"block"}
            assert key in ("feedback", "response")

    asyncio.run(ask())


class FrontEndOnly:
    """A door over a service whose engine is never opened: bodies cannot be checked, so saving is refused."""

    def __init__(self) -> None:
        from roboglot.model.clock import LockstepClock
        from roboglot.programs.engine import Engine
        from roboglot.programs.service import ProgramService
        from roboglot.protocols.visual.server import VisualDoor

        self.sent: list[str] = []
        engine = Engine()
        engine._closed = True
        robot = Robot("a", None, LockstepClock())  # type: ignore[arg-type]
        self.database = Database(":memory:")
        self.door = VisualDoor(ProgramService(robot, engine, self.database))
        self.door.subscribe(self.sent.append)

    async def receive(self, text: str) -> None:
        try:
            await self.door.receive(text)
        finally:
            self.database.close()


async def test_modules_people_and_maps_say_what_is_not_there(app: FrontEnd) -> None:
    assert (await app.ask("inquiry", type="module"))[0]["list"] == []
    assert (await app.ask("delete", "m", type="module"))[0]["state"] == 27
    fields = {"mode": "common", "condition": "f()", "body": "pass"}
    assert (await app.ask("save", "m", type="module", **fields))[0]["state"] == 29
    assert (await app.ask("inquiry", type="AI", mode="face"))[0]["state"] == 29
    assert (await app.ask("inquiry", type="SLAM", mode="map"))[0]["state"] == 29  # this robot keeps no maps


async def test_the_maps_of_a_robot_that_keeps_some(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    for mode in ("map", "preset"):
        assert (await app.ask("inquiry", type="SLAM", mode=mode))[0]["list"] == []
    grid = OccupancyGrid(np.zeros((2, 2), np.int8), 0.05, Point())
    for name, labels in (("old", ()), ("home", (Label("厨房", Point(1.5, -2)), Label("desk", Point(0, 3))))):
        await robot[MapLibrary].put(StoredMap(name, grid, 0.0, labels))
    [maps] = await app.ask("inquiry", type="SLAM", mode="map")
    assert [item["id"] for item in maps["list"]] == ["home", "old"]
    [presets] = await app.ask("inquiry", type="SLAM", mode="preset")
    assert [item["id"] for item in presets["list"]] == ["desk", "厨房"]
    assert presets["list"][1] == {
        "id": "厨房",
        "mode": "preset",
        "style": "[1.500000, -2.000000, 0.000000]",
        "condition": "home",
        "describe": "厨房",
    }
    [one] = await app.ask("inquiry", "厨房", type="SLAM", mode="preset")
    assert [item["id"] for item in one["list"]] == ["厨房"]


async def test_a_lost_client_does_not_leave_half_an_operation(app: FrontEnd) -> None:
    await app.save("t", BUSY)
    frame = json.dumps({"type": "task", "id": "x", "operate": "run", "target_id": ["t"]})
    request = asyncio.create_task(app.door.receive(frame))
    await asyncio.sleep(0)
    request.cancel()
    await app.until(lambda: app.news("t", "start"))
    assert await app.state("t") == "run"


async def test_the_state_is_stored_before_it_is_told(connect: Connect, plain_robot: Robot, tmp_path: Path) -> None:
    database = Database(tmp_path / "robot.db")
    app = await connect(plain_robot, database)
    told: list[tuple[str, str]] = []
    reader = Database(tmp_path / "robot.db")

    def note(text: str) -> None:
        feedback = json.loads(text)["feedback"]
        found = reader.run_now(lambda c: c.execute("SELECT state FROM program WHERE id='t'").fetchone())
        told.append((feedback["operate"], found[0] if found else "null"))

    app.door.subscribe(note)
    await app.start("t", BUSY)
    for operation in ("suspend", "recover", "shutdown", "delete"):
        await app.ask(operation, "t")
    reader.close()
    assert told == [
        ("save", "wait_run"),
        ("run", "run_wait"),
        ("start", "run"),
        ("suspend", "run"),
        ("suspend", "suspend"),
        ("recover", "suspend"),
        ("recover", "run"),
        ("shutdown", "run"),
        ("shutdown", "shutdown"),
        ("delete", "null"),
    ]
    await app.service.close()
    database.close()


async def test_what_ran_when_the_server_died_is_ended_with_a_note(connect: Connect, plain_robot: Robot) -> None:
    database = Database(":memory:")
    store = ProgramStore(database, plain_robot.id)
    for id, mode, state in (("t1", "single", "run"), ("t2", "cycle", "suspend"), ("t3", "single", "wait_run")):
        await store.put(StoredProgram(id, "", "", mode, "now", "pass", state))
    await store.append_log("t1", [LogEntry(0.0, "print", "before")])
    app = await connect(plain_robot, database)
    assert [await app.state(id) for id in ("t1", "t2", "t3")] == ["shutdown", "run_wait", "wait_run"]
    assert [entry.level for entry in await app.service.log("t1")] == ["print", "error"]
    assert (await app.ask("run", "t1"))[0]["state"] == 0
    await app.ends("t1")
    database.close()


async def test_closing_the_server_ends_the_programs(app: FrontEnd) -> None:
    await app.start("t", BUSY)
    pid = app.service._runs["t"]._run.pid
    await app.service.close()
    assert not alive(pid)
    assert await app.state("t") == "shutdown"


async def test_a_killed_worker_is_told_not_left_running(app: FrontEnd) -> None:
    await app.start("t", FOREVER)
    os.kill(app.service._runs["t"]._run.pid, 9)
    await app.ends("t", pace=0.0)
    assert app.news("t", "run")[-1]["feedback"]["state"] == 26
    assert await app.state("t") == "shutdown"


def process_state(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


def alive(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()
