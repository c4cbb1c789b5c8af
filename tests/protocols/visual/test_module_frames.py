"""Frames of type module, and tasks that call modules."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from roboglot.model.components.energy.battery import Battery
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState
from roboglot.storage.database import Database
from tests.protocols.visual.front_end import Frame, FrontEnd

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]


async def module(app: FrontEnd, id: str, interface: str, body: str, **fields: Any) -> Frame:
    values = {"mode": "common", "condition": interface, "body": body} | fields
    [answer] = await app.ask(values.pop("operate", "save"), id, type="module", **values)
    return answer


async def listed(app: FrontEnd, type: str = "module") -> dict[str, Frame]:
    [answer] = await app.ask("inquiry", type=type)
    return {item["id"]: item for item in answer["list"]}


async def test_a_task_calls_a_module_that_calls_another(app: FrontEnd) -> None:
    assert (await module(app, "m1", "double(n)", "return 2 * n"))["state"] == 0
    assert (await module(app, "m2", "say(text, n)", "print(text, double(n))", operate="add"))["state"] == 0
    await app.start("t", "say('twice', 21)\nsay('two', 1)")
    await app.ends("t")
    assert await app.printed("t") == ["twice 42", "two 2"]


async def test_lists_show_dependencies_both_ways(app: FrontEnd) -> None:
    await module(app, "m1", "double(n)", "return 2 * n", describe="doubles", style="[]", mode="sequence")
    await module(app, "m2", "say(n)", "print(double(n))")
    await app.save("t", "say(1)")
    await app.save("own", "def say(n):\n    pass\nsay('double(2)')  # double(3)")
    modules, tasks = await listed(app), await listed(app, "task")
    assert modules["m1"] == {
        "id": "m1",
        "describe": "doubles",
        "style": "[]",
        "operate": "normal",
        "mode": "sequence",
        "condition": "double(n)",
        "dependent": [],
        "be_depended": ["m2"],
    }
    assert (modules["m2"]["dependent"], modules["m2"]["be_depended"]) == (["m1"], ["t"])
    assert (tasks["t"]["dependent"], tasks["t"]["be_depended"]) == (["m2"], [])
    assert tasks["own"]["dependent"] == []  # its own definition, text and comments are no calls
    [one] = await app.ask("inquiry", "m2", "unknown", type="module")
    assert [item["id"] for item in one["list"]] == ["m2"]


async def test_called_modules_cannot_be_deleted(app: FrontEnd) -> None:
    await module(app, "m1", "f()", "pass")
    await module(app, "m10", "g()", "f()")
    await app.save("t", "g()")
    answers = await app.ask("delete", "m1", "m10", "m100", type="module")
    assert [(a["target_id"], a["state"]) for a in answers] == [("m1", 27), ("m10", 27), ("m100", 27)]
    assert "m10" in answers[0]["describe"]
    await app.ask("delete", "t")
    answers = await app.ask("delete", "m10", "m1", type="module")
    assert [a["state"] for a in answers] == [0, 0]
    assert await listed(app) == {}
    assert (await app.save("t", "g()"))["state"] == 23


async def test_names_are_one_modules_own_and_stay(app: FrontEnd) -> None:
    assert (await module(app, "m1", "f(a)", "pass"))["state"] == 0
    for id, interface in (("m2", "f()"), ("m1", "g()"), ("m3", "print(x)"), ("m4", "cyberdog()"), ("m5", "time()")):
        answer = await module(app, id, interface, "pass")
        assert answer["state"] == 9, interface
    for interface in ("2f()", "f(a=1)", "f(a,)", "f", "def()", ""):
        assert (await module(app, "m6", interface, "pass"))["state"] == 9, interface
    assert (await module(app, "m1", "f(a, b)", "pass"))["state"] == 0  # parameters may change
    assert list(await listed(app)) == ["m1"]


async def test_modules_that_would_call_themselves_through_others(app: FrontEnd) -> None:
    await module(app, "m1", "f()", "pass")
    await module(app, "m2", "g()", "f()")
    await module(app, "m3", "h()", "g()")
    answer = await module(app, "m1", "f()", "h()")
    assert answer["state"] == 28
    assert (await listed(app))["m1"]["dependent"] == []
    assert (await module(app, "m4", "down(n)", "return n and down(n - 1)"))["state"] == 0  # plain recursion


async def test_wrong_module_is_kept_and_stops_its_callers(app: FrontEnd) -> None:
    await module(app, "m", "f(n)", "return n")
    await app.save("t", "print(f(1))")
    answer = await module(app, "m", "f(n)", "x = 1\nif n = 2:\n    pass")
    assert answer["state"] == 23
    assert "line 2, column 4" in answer["describe"]
    assert (await listed(app))["m"]["operate"] == "error"
    [answer] = await app.ask("run", "t")
    assert (answer["state"], "f (m)" in answer["describe"]) == (26, True)
    assert await app.state("t") == "wait_run"
    assert (await app.save("t2", "f(2)"))["state"] == 0
    await module(app, "m", "f(n)", "return n + 1")
    await app.ask("run", "t")
    await app.ends("t")
    assert await app.printed("t") == ["2"]


async def test_errors_in_a_module_name_its_line(app: FrontEnd) -> None:
    await module(app, "m", "f(n)", "x = n\nreturn 1 / x")
    await app.start("t", "print('on')\nf(0)")
    await app.ends("t")
    [error] = [f["feedback"] for f in app.news("t", "run")]
    assert error["describe"] == "ZeroDivisionError: division by zero (module f, line 2: return 1 / x)"


async def test_debug_runs_use_modules_without_preventing_their_deletion(app: FrontEnd) -> None:
    await module(app, "m", "f()", "print('module')")
    await app.ask("debug", "debug", mode="single", condition="now", body="f()")
    await app.ends("debug")
    assert await app.printed("debug") == ["module"]
    assert (await listed(app))["m"]["be_depended"] == []
    assert (await app.ask("delete", "m", type="module"))[0]["state"] == 0


async def test_task_and_module_of_one_id_are_separate(app: FrontEnd) -> None:
    await module(app, "x", "f()", "pass")
    await app.save("x", "f()")
    assert (await listed(app))["x"]["be_depended"] == ["x"]
    assert (await app.ask("delete", "x", type="module"))[0]["state"] == 27
    await app.ask("delete", "x")
    assert (await app.ask("delete", "x", type="module"))[0]["state"] == 0


async def test_modules_survive_the_server(connect: Connect, plain_robot: Robot, tmp_path: Path) -> None:
    database = Database(tmp_path / "robot.db")
    app = await connect(plain_robot, database)
    await module(app, "m", "f()", "print('kept')")
    await app.save("t", "f()")
    app = await connect(plain_robot, database)
    assert (await app.ask("delete", "m", type="module"))[0]["state"] == 27
    await app.ask("run", "t")
    await app.ends("t")
    assert await app.printed("t") == ["kept"]
    await app.service.close()
    database.close()


async def test_the_robots_mode_counts_for_modules_too(app: FrontEnd, plain_robot: Robot) -> None:
    class Empty(Battery):
        @property
        def state(self) -> BatteryState:
            return BatteryState(0.04, 24.0, -1.0, 25.0, False, 1)

    plain_robot.add(Battery, Empty())
    assert (await module(app, "m", "f()", "pass"))["state"] == 0  # LowPower x save is legal
    assert (await app.ask("inquiry", type="module"))[0]["list"][0]["id"] == "m"
