"""Classes over real sockets: a world for each pupil, everything stopped at once, what is handed in outlives a crash."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, load_config
from roboglot.console.studio import classroom
from roboglot.console.studio.programs import ClassHome
from roboglot.model.action import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose
from roboglot.runtime import Runtime
from roboglot.shards.classes import FleetClasses
from tests.console.conftest import ADDRESS, OTHER_ADDRESS, ServedConsole
from tests.console.test_studio_socket import SAVE, Page, page

OPEN = AccessConfig()
DOING = {"phase": "running", "lit": "walk", "program": "mine", "stars": 3}


@asynccontextmanager
async def world(
    folder: Path, name: str, address: str, *, shared: bool = True, access: AccessConfig = OPEN
) -> AsyncIterator[ServedConsole]:
    """Yield a world whose console shares the classroom of the fleet in ``folder``."""
    base = load_config(None, {"data": str(folder / name), "world": "empty", "lockstep": True})
    robots = (RobotConfig("a", "universal", address),)
    config = replace(base, robots=robots, access=access, console=ConsoleConfig(port=0))
    runtime = Runtime(config, class_home=ClassHome(folder / "class", name) if shared else None)
    assert isinstance(runtime.clock, LockstepClock)
    assert runtime.console is not None
    await runtime.start()
    await runtime.console.ready()
    yield ServedConsole(runtime, runtime.fleet.robots["a"], runtime.clock, runtime.console.address)
    await runtime.close()


@pytest_asyncio.fixture
async def fleet(tmp_path: Path) -> AsyncIterator[list[ServedConsole]]:
    """Two worlds with one classroom, as ``roboglot fleet up --worlds 2`` has them."""
    classes = FleetClasses(tmp_path)
    await classes.open()
    async with world(tmp_path, "w1", ADDRESS) as first, world(tmp_path, "w2", OTHER_ADDRESS) as second:
        yield [first, second]
    await classes.close()


async def opened(teacher: Page) -> str:
    await asked(teacher, do="open", name="7b")
    return str((await teacher.kind("grid"))["code"])


async def asked(page: Page, **wish: Any) -> None:
    await page.say(type="class", **wish)


async def grid(teacher: Page, **wanted: object) -> dict[str, Any]:
    """Return the teacher's row of the last pupil once it shows this."""
    found = await teacher.until(
        lambda m: m["type"] == "grid" and m["pupils"] and wanted.items() <= m["pupils"][-1].items()
    )
    return dict(found["pupils"][-1])


@asynccontextmanager
async def passing(served: ServedConsole) -> AsyncIterator[None]:
    """Let robot time pass."""

    async def advance() -> None:
        while True:
            await served.clock.advance(0.1)
            await asyncio.sleep(0)

    task = asyncio.create_task(advance())
    yield
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


async def test_each_pupil_has_a_world(fleet: list[ServedConsole]) -> None:
    first, second = fleet
    async with page(first) as teacher, page(first) as anna, page(first) as ben, page(second) as moved:
        code = await opened(teacher)
        await asked(anna, do="join", code=code, name="Anna")
        assert (await anna.kind("joined"))["number"] == 0
        await asked(ben, do="join", code=code, name="Ben", style='{"body": "his"}')
        sent = await ben.kind("elsewhere")
        assert (sent["page"], sent["code"], sent["name"]) == (second.url, code, "Ben")
        await asked(moved, do="join", code=code.lower(), name="Ben", carry=True)
        joined = await moved.kind("joined")
        assert (joined["class"], joined["style"]) == ("7b", '{"body": "his"}')  # his work comes with him
        await asked(moved, do="doing", doing=DOING, style='{"body": "x = 1"}')
        assert (await teacher.kind("map"))["name"] == "Ben"
        await asked(moved, do="doing", doing=DOING)
        row = await grid(teacher, here=True, phase="running")
        assert (row["name"], row["world"], row["robot"], row["lit"]) == ("Ben", "w2", "a", "walk")
        await asked(teacher, do="look", id=7, name="Ben")
        assert (await teacher.kind("looked"))["style"] == '{"body": "x = 1"}'
        await asked(ben, do="look", id=8, name="Anna")  # no teacher
        assert "only the teacher" in (await ben.kind("refused"))["why"]


async def test_all_are_stopped_without_their_pages_too(fleet: list[ServedConsole]) -> None:
    first, second = fleet
    async with page(first) as teacher, page(first) as anna:
        code = await opened(teacher)
        await asked(anna, do="join", code=code, name="Anna")
        await anna.kind("joined")
        async with page(second) as ben:
            await asked(ben, do="join", code=code, name="Ben")
            await ben.kind("joined")
            await ben.frame(**SAVE, id="1", body="while True:\n    time.sleep(1)\n")
            await ben.frame(type="task", operate="run", target_id=["t"], id="2", mode="single", condition="now")
            await ben.until(lambda m: m["type"] == "frame" and "start task" in m["text"])
        await grid(teacher, name="Ben", here=False)
        driving = [served.robot[Driving].move_by(Pose(3.0, 0.0, 0.0)) for served in fleet]
        async with passing(first), passing(second):
            await asked(teacher, do="stop_all", id=5)
            async with asyncio.timeout(60):
                ends = [await action.done() for action in driving]
        assert ends == [ActionStatus.CANCELED] * 2
        service = next(iter(second.runtime._programs.values())).service
        assert service.running() == []
        assert [entry.text for entry in await service.log("t")] == ["ended by the teacher"]


async def test_a_world_that_ends_leaves_the_class(tmp_path: Path) -> None:
    classes = FleetClasses(tmp_path)
    await classes.open()
    async with world(tmp_path, "w1", ADDRESS) as first, page(first) as teacher:
        code = await opened(teacher)
        async with world(tmp_path, "w2", OTHER_ADDRESS) as second, page(second) as ben:
            await asked(teacher, do="join", code=code, name="Anna")
            await teacher.kind("joined")
            await asked(teacher, do="open", code=code)
            await asked(ben, do="join", code=code, name="Ben")
            await grid(teacher, name="Ben", here=True)
        await grid(teacher, name="Ben", here=False)
        await asked(teacher, do="stop_all", id=3)  # a missing world is named
        refused = await teacher.until(lambda m: m["type"] == "refused")
        assert refused["id"] == 3
        assert "w2" in refused["why"]
        await classes.close()
        assert (await teacher.kind("left"))["type"] == "left"
        await asked(teacher, do="open", id=4, name="8c")
        assert "out of reach" in (await teacher.kind("refused"))["why"]


@pytest.mark.parametrize("shared", [False, True])
async def test_pages_gone_at_once_keep_no_class(tmp_path: Path, shared: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their pages have gone before their classes are stored."""
    monkeypatch.setattr(classroom, "CLASSES_MAX", 1)
    classes = FleetClasses(tmp_path)
    await classes.open()
    async with world(tmp_path, "w", ADDRESS, shared=shared) as served:
        for number in range(10):
            async with page(served) as gone:
                await asked(gone, do="open", name=str(number))
                gone._socket.transport.abort()
        answer = {"type": "refused"}
        async with asyncio.timeout(60):
            while answer["type"] == "refused":  # until the console has heard of it
                async with page(served) as teacher:
                    await asked(teacher, do="open", name="7b")
                    answer = await teacher.until(lambda m: m["type"] in ("grid", "refused"))
        assert answer["name"] == "7b"
    await classes.close()


async def test_handed_in_work_survives_a_restart(tmp_path: Path) -> None:
    async with world(tmp_path, "w", ADDRESS, shared=False) as served, page(served) as teacher, page(served) as anna:
        code = await opened(teacher)
        await asked(anna, do="join", code=code, name="Anna")
        await asked(anna, do="hand_in", doing=DOING, style='{"body": "x = 1"}')
        await anna.kind("handed")
    (tmp_path / "w" / "classes" / "ZZZZZZ").mkdir()  # from another page
    async with world(tmp_path, "w", ADDRESS, shared=False) as served, page(served) as teacher, page(served) as anna:
        await asked(teacher, do="open", code="ZZZZZZ")
        assert "there is no class" in (await teacher.kind("refused"))["why"]
        await asked(teacher, do="open", code=code)
        row = await grid(teacher, name="Anna", here=False)
        assert (row["handed"], row["handed_stars"], row["stars"], row["program"]) == (True, 3, 3, "mine")
        await asked(teacher, do="look", id=9, name="Anna")
        assert json.loads((await teacher.kind("looked"))["style"]) == {"body": "x = 1"}
        await asked(anna, do="join", code=code, name="Anna")
        await anna.kind("joined")
        await grid(teacher, name="Anna", here=True)
