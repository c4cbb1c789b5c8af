"""Frames of tasks: what each operation answers, and what tasks report by themselves."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.light import Light, LightEffect
from roboglot.model.errors import Unconnected
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState
from roboglot.programs.engine.events import ExitReason
from roboglot.programs.engine.run import Run
from roboglot.programs.tasks.states import TaskOperation, TaskState, next_state
from roboglot.simulation.world.world import World
from tests.protocols.visual.front_end import FrontEnd, alive

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]
BUSY = "while True:\n    pass\n"
FOREVER = "time.sleep(100000)\n"


async def test_life_of_task_as_the_app_sees_it(app: FrontEnd) -> None:
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


@pytest.mark.world("empty")
async def test_nothing_is_saved_on_a_full_disk(connect: Connect, robot: Robot, world: World) -> None:
    app = await connect(robot)
    assert (await app.save("t1", "pass"))["state"] == 0
    world.faults.inject("full_disk", "a")
    assert (await app.save("t1", "print(1)"))["describe"] == "the disk is full"
    [answer] = await app.ask("save", "m1", type="module", mode="common", condition="double(n)", body="return 2 * n")
    assert answer["describe"] == "the disk is full"
    [answer] = await app.ask("run", "t1")  # existing tasks run
    assert answer["state"] == 0
    await app.ends("t1")
    [answer] = await app.ask("delete", "t1")
    assert answer["state"] == 0
    [listed] = await app.ask("inquiry")
    assert listed["list"] == []
    world.faults.clear()
    assert (await app.save("t1", "pass"))["state"] == 0


async def test_list_returns_saved_entries_without_the_body(app: FrontEnd) -> None:
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


async def test_wrong_body_is_kept_as_a_located_error(app: FrontEnd) -> None:
    answer = await app.save("t", "x = 1\ncyberdog.motion.trun(90)\n")
    assert answer["state"] == 23
    assert "line 2" in answer["describe"]
    assert "'turn'" in answer["describe"]
    assert await app.state("t") == "error"
    [answer] = await app.ask("run", "t")
    assert answer["state"] == 27
    assert (await app.save("t", "x = 1"))["state"] == 0


async def test_unsupported_calls_are_reported_in_their_answer(app: FrontEnd) -> None:
    await app.start("t", "print(cyberdog.led.freed(9).response.code)\n")
    await app.ends("t")
    assert await app.printed("t") == ["1121"]


async def test_uncaught_error_ends_the_task_and_is_reported(app: FrontEnd) -> None:
    await app.start("t", "cyberdog.task.block('a')\nd = {}\nd['厨房']\n")
    await app.ends("t")
    error, block_end = app.news("t", "run")[1:]
    assert error["feedback"]["state"] == 26
    assert error["feedback"]["describe"] == "KeyError: '厨房' (line 3: d['厨房'])"
    assert block_end["block"] == {"type": "end", "id": "a"}
    assert await app.state("t") == "shutdown"
    assert (await app.service.log("t"))[-1].level == "error"


async def test_texts_beyond_utf8_are_reported_and_logged(app: FrontEnd) -> None:
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


@pytest.mark.world("empty")
async def test_shutdown_of_a_robot_out_of_reach(
    connect: Connect, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lost robot's lights could not be restored, and so the program that had taken them went on."""

    def lost(*_: object, **__: object) -> None:
        raise Unconnected("the robot is not connected")

    app = await connect(robot)
    await app.start("t", "cyberdog.led.play(2, 161)\nwhile True:\n    n = 1\n")
    await app.until(lambda: robot[Light].state("tail").effect is not LightEffect.OFF)
    run = app.service._runs["t"]._run
    monkeypatch.setattr(type(robot[Light]), "shine", lost)
    await app.ask("shutdown", "t")
    assert not alive(run.pid)
    assert await app.state("t") == "shutdown"


async def test_the_first_feedback_comes_before_the_second(app: FrontEnd) -> None:
    await app.start("t", BUSY)
    before = len(app.frames)
    await app.ask("suspend", "t")
    first, second = (frame["feedback"] for frame in app.frames[before:])
    assert not first["id"].startswith("task_")
    assert second["id"].startswith("task_")


async def test_a_suspended_sleep_sleeps_on_afterwards(app: FrontEnd) -> None:
    await app.start("t", "time.sleep(10)\nprint(time.monotonic())\n")
    run = app.service._runs["t"]
    await app.until(lambda: run._answering and run._answering.get_name() == "call time.sleep", pace=0.0)
    began = app.clock.time()
    await app.clock.advance(4.0)
    await app.ask("suspend", "t")
    await app.clock.advance(1000.0)
    assert await app.state("t") == "suspend"
    await app.ask("recover", "t")
    await app.clock.advance(5.9)
    assert run._answering is not None
    assert not run._answering.done()
    await app.clock.advance(0.2)
    await app.ends("t", pace=0.0)
    [woke] = await app.printed("t")
    assert began + 1010.0 <= float(woke) <= began + 1010.2


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
    answers = await app.ask("suspend", "t1", "unknown", "t10")
    assert [(a["target_id"], a["state"]) for a in answers] == [("unknown", 27), ("t1", 0)]
    assert len(app.news("t1", "suspend")) == len(app.news("t10", "suspend")) == 1
    await app.ask("shutdown", "t1")
    assert (await app.state("t1"), await app.state("t10")) == ("shutdown", "suspend")


async def test_shutdown_of_several_kills_all_before_it_waits(app: FrontEnd, monkeypatch: pytest.MonkeyPatch) -> None:
    ids = ["t1", "t2", "t3"]
    for id in ids:
        await app.start(id, "while True: pass")
    runs = [app.service._runs[id]._run for id in ids]
    waits = []
    wait = Run.wait

    async def noted(run: Run) -> None:
        waits.append([other.exit_reason for other in runs])
        await wait(run)

    monkeypatch.setattr(Run, "wait", noted)
    await app.ask("shutdown", *ids)
    assert waits[0] == [ExitReason.KILLED] * 3
    assert all(app.news(id, "shutdown") for id in ids)


async def test_a_line_ends_where_the_program_ends_it(app: FrontEnd) -> None:
    body = "for n in range(3):\n    print(n, end=' ')\n    time.sleep(0.1)\nprint()\n"
    body += "print('a\\x0bb\\u2028c')\nprint('on', end='')"
    await app.start("t", body)
    await app.ends("t")
    assert await app.printed("t") == ["0 1 2 ", "a\x0bb\u2028c", "on"]
    await app.start("u", "print('half', end='')\n1 / 0")
    await app.ends("u")
    entries = [(entry.level, entry.text[:17]) for entry in await app.service.log("u")]
    assert entries[-2:] == [("print", "half"), ("error", "ZeroDivisionError")]


async def test_running_tasks_report_their_use(app: FrontEnd) -> None:
    await app.start("t", "x = bytearray(20_000_000)\nfor n in range(2_000_000): pass\ntime.sleep(1e5)")
    await app.until(lambda: app.service.running()[0].cpu > 0.02 and app.service.running()[0].memory > 20_000_000)
    [figures] = app.service.running()
    assert (figures.target_id, figures.state) == ("t", "run")
    assert figures.age > 0
    await app.ask("shutdown", "t")
    assert app.service.running() == []


async def test_delete_answers_per_target_with_similar_ids(app: FrontEnd) -> None:
    for id in ("t1", "t10", "t2"):
        await app.save(id, "pass")
    await app.start("t2", BUSY)
    answers = await app.ask("delete", "t1", "t2", "unknown")
    assert [(a["target_id"], a["state"]) for a in answers] == [("t1", 0), ("t2", 27), ("unknown", 0)]
    assert [await app.state(id) for id in ("t1", "t10", "t2")] == ["null", "wait_run", "run"]


async def test_running_a_running_task_starts_no_second_one(app: FrontEnd) -> None:
    await app.start("t", BUSY)
    pid = app.service._runs["t"]._run.pid
    [answer] = await app.ask("run", "t", mode="single", condition="21:30")
    assert answer["state"] == 0
    assert (len(app.news("t", "start")), app.service._runs["t"]._run.pid) == (1, pid)
    [listed] = await app.ask("inquiry", "t")
    assert (listed["list"][0]["condition"], listed["list"][0]["operate"]) == ("21:30", "run")


async def test_debug_runs_at_once_replacing_itself_unlisted(app: FrontEnd) -> None:
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


async def test_the_robots_mode_refuses_in_the_vendors_words(app: FrontEnd, plain_robot: Robot) -> None:
    battery = Charge()
    plain_robot.add(Battery, battery)
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
    TaskState.RUN_WAIT: [("save", BUSY), ("later", "")],
    TaskState.RUN: [("save", BUSY), ("run", "")],
    TaskState.SUSPEND: [("save", BUSY), ("run", ""), ("suspend", "")],
    TaskState.SHUTDOWN: [("save", BUSY), ("run", ""), ("shutdown", "")],
}
USER_OPERATIONS = [operation for operation in TaskOperation if operation not in ("start", "stop", "debug")]


@pytest.mark.parametrize("state", PREPARATIONS)
async def test_frames_do_what_the_table_says(app: FrontEnd, state: TaskState) -> None:
    async def do(operation: str, body: str) -> Any:
        if operation == "later":
            return (await app.ask("run", "t", mode="single", condition="now + 5days"))[0]
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
        assert after == (
            state if expected is None else "run" if (operation, expected) == ("run", "run_wait") else expected
        ), operation
        for cleaning in ("shutdown", "delete"):
            await app.ask(cleaning, "t")
        app.frames.clear()


def process_state(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
