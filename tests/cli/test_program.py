"""``roboglot program`` as people call it: a separate process, against a robot's WebSocket."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pytest

from roboglot.model.clock import RealClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.config import VisualConfig
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores

PATIENCE = 90.0  # s of the machine's time
HELLO = "cyberdog.task.block('greet')\nprint('hello')\nprint('狗')\n"


@dataclass
class Ended:
    status: int
    out: str
    err: str


class Shell:
    """Calls the command line against one robot."""

    def __init__(self, service: ProgramService, address: str, folder: Path) -> None:
        self.service = service
        self.address = address
        self.folder = folder
        self._begun: list[asyncio.subprocess.Process] = []

    def file(self, name: str, text: str) -> str:
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    async def begin(self, *arguments: str, typed: bool = False) -> asyncio.subprocess.Process:
        command = [sys.executable, "-m", "roboglot", "program", *arguments, "--robot", self.address]
        pipe = asyncio.subprocess.PIPE
        stdin = pipe if typed else asyncio.subprocess.DEVNULL
        process = await asyncio.create_subprocess_exec(*command, stdin=stdin, stdout=pipe, stderr=pipe)
        self._begun.append(process)
        return process

    async def close(self) -> None:
        """End what a test that failed has left."""
        for process in self._begun:
            if process.returncode is None:
                process.kill()
                await process.communicate()

    async def call(self, *arguments: str) -> Ended:
        process = await self.begin(*arguments)
        out, err = await asyncio.wait_for(process.communicate(), PATIENCE)
        return Ended(cast(int, process.returncode), out.decode(), err.decode())


@pytest.fixture
async def shell(tmp_path: Path) -> AsyncIterator[Shell]:
    database, engine = Database(":memory:"), Engine()
    service = ProgramService(Robot("a", cast(Description, None), RealClock()), engine, program_stores(database, "a"))
    door = VisualDoor(service, "127.0.0.78", VisualConfig(port=0))
    await door.start()
    shell = Shell(service, door.endpoints[0].address, tmp_path)
    yield shell
    await shell.close()
    await door.close()
    await engine.close()
    database.close()


async def test_run_shows_prints_and_blocks_and_logs_them(shell: Shell) -> None:
    ran = await shell.call("run", shell.file("my-first program.py", HELLO))
    assert (ran.status, ran.out, ran.err.splitlines()) == (0, "hello\n狗\n", ["▶ greet", "■ greet"])
    listed = await shell.call("list")
    assert "my_first_program  shutdown  single  now" in listed.out
    log = await shell.call("log", "my_first_program")
    assert [line[20:] for line in log.out.splitlines()] == ["print hello", "print 狗"]


async def test_a_program_is_walked_through(shell: Shell) -> None:
    path = shell.file("t.py", "n = 1\nprint(n)\nn += 1\n\nprint(n)\n")
    process = await shell.begin("run", path, "--break", "2", "--break", "4", typed=True)
    out, err = await asyncio.wait_for(process.communicate(b"\nc\nc\n"), PATIENCE)
    halts = [line for line in err.decode().splitlines() if line.startswith("‖")]
    assert (process.returncode, out, halts) == (0, b"1\n2\n", ["‖    2 print(n)", "‖    3 n += 1", "‖    5 print(n)"])
    process = await shell.begin("run", path, "--step", typed=True)
    out, err = await asyncio.wait_for(process.communicate(b"s\nq\n"), PATIENCE)
    assert (process.returncode, out) == (1, b"")
    assert "you ended it" in err.decode()
    assert "no line 99" in (await shell.call("run", path, "--break", "99")).err


async def test_a_program_that_fails_says_where(shell: Shell) -> None:
    failed = await shell.call("run", shell.file("t.py", "print('on')\n1 / 0\n"))
    assert (failed.status, failed.out) == (1, "on\n")
    assert failed.err.splitlines() == ["ZeroDivisionError: division by zero (line 2: 1 / 0)"]
    wrong = await shell.call("save", shell.file("t.py", "if x\n    pass\n"))
    assert (wrong.status, "line 1" in wrong.err, "(23)" in wrong.err) == (1, True, True)


async def test_check_needs_no_robot(shell: Shell) -> None:
    path = shell.file("t.py", "cyberdog.motion.trun(1)\n")
    checked = await shell.call("check", path)
    assert checked.status == 1
    assert checked.out.startswith(f"{path}:1:")
    assert "'turn'" in checked.out
    assert (await shell.call("check", shell.file("t.py", HELLO))).status == 0


@pytest.mark.slow
async def test_modules_and_lists_for_machines(shell: Shell) -> None:
    path = shell.file("greet.py", "print('hello', name)\n")
    assert (await shell.call("save", path, "--interface", "greet(name)")).out == "greet is saved\n"
    assert "greet(name)" in (await shell.call("list", "--modules")).out
    await shell.call("run", shell.file("t.py", "greet('\\x1b[2Jyou')\nprint('x', end=' ')\nprint('y')\n"))
    [module] = json.loads((await shell.call("list", "--modules", "--json")).out)
    assert (module["id"], module["be_depended"]) == ("greet", ["t"])
    [task] = json.loads((await shell.call("list", "--json")).out)
    assert (task["id"], task["dependent"], task["run"]) == ("t", ["greet"], None)
    lines = json.loads((await shell.call("log", "t", "--json")).out)
    assert [(line["level"], line["text"]) for line in lines] == [("print", "hello \x1b[2Jyou"), ("print", "x y")]
    assert (await shell.call("log", "t")).out.splitlines()[0].endswith("hello \\x1b[2Jyou")
    checked = json.loads((await shell.call("check", shell.file("w.py", "1 +\n"), "--json")).out)
    assert checked["problems"][0]["line"] == 1
    assert (await shell.call("delete", "t")).status == 0
    assert (await shell.call("delete", "greet", "--modules")).status == 0
    assert (await shell.call("save", path, "--json")).status == 2


async def test_list_shows_the_use_of_running_programs(shell: Shell) -> None:
    process = await shell.begin("run", shell.file("t.py", "print('on')\nwhile True:\n    pass\n"))
    assert process.stdout
    assert await asyncio.wait_for(process.stdout.readline(), PATIENCE) == b"on\n"
    [task] = json.loads((await shell.call("list", "--json")).out)
    assert task["run"]["state"] == "run"
    assert task["run"]["memory"] > 0
    assert "MB" in (await shell.call("list")).out
    await shell.call("shutdown", "t")
    await asyncio.wait_for(process.communicate(), PATIENCE)


async def test_a_cycle_waits_for_its_time(shell: Shell) -> None:
    planned = await shell.call("run", shell.file("t.py", HELLO), "--cycle", "--when", "0 0 1 1 *", "--id", "new_year")
    assert (planned.status, planned.out) == (0, "new_year waits for 0 0 1 1 *\n")
    assert "new_year  run_wait  cycle  0 0 1 1 *" in (await shell.call("list")).out


async def test_task_is_suspended_recovered_shut_down_and_deleted(shell: Shell) -> None:
    process = await shell.begin("run", shell.file("t.py", "print('on')\nwhile True:\n    pass\n"))
    assert process.stdout
    assert await asyncio.wait_for(process.stdout.readline(), PATIENCE) == b"on\n"
    for operate, state in (("suspend", "suspend"), ("recover", "run"), ("shutdown", "shutdown"), ("delete", "")):
        answer = await shell.call(operate, "t")
        assert (answer.status, answer.out, answer.err) == (0, f"t: {operate} accepted\n", "")
        async with asyncio.timeout(PATIENCE):
            while "".join(task.state for task in await shell.service.tasks()) != state:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
    assert b"another client ended it" in (await asyncio.wait_for(process.communicate(), PATIENCE))[1]
    refused = await shell.call("recover", "t")
    assert (refused.status, "(27)" in refused.err) == (1, True)


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Anyone who runs the tests in the background of a script has processes ignore interruptions from the start."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
async def test_an_interruption_ends_the_program(shell: Shell) -> None:
    process = await shell.begin("run", shell.file("t.py", "print('on')\nwhile True:\n    pass\n"))
    assert process.stdout
    assert await asyncio.wait_for(process.stdout.readline(), PATIENCE) == b"on\n"
    process.send_signal(signal.SIGINT)
    await asyncio.wait_for(process.communicate(), PATIENCE)
    assert process.returncode == 130
    async with asyncio.timeout(PATIENCE):  # the command was delivered; the program may still run
        while [task.state for task in await shell.service.tasks()] != ["shutdown"]:  # noqa: ASYNC110
            await asyncio.sleep(0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run",), "which file"),
        (("run", "/nowhere/t.py"), "No such file"),
        (("log", "unknown"), "there is no task unknown"),
        (("list", "--robot", "ws://127.0.0.78:9"), "no answer"),
        (("list", "--robot", "http://x"), "ws://HOST:PORT"),
    ],
)
async def test_mistakes_are_reported_in_one_line(shell: Shell, arguments: tuple[str, ...], words: str) -> None:
    shell.address = arguments[-1] if "--robot" in arguments else shell.address
    ended = await shell.call(*arguments)
    assert ended.status == 1
    assert words in ended.err
    assert "Traceback" not in ended.err


async def test_a_robot_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "t.py"
    path.write_text("print(cyberdog.motion.get_down().state.code == StateCode.success)\n")
    options: list[Any] = ["--own", "--world", "empty", "--speed", "10"]
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "roboglot", "program", "run", str(path), *options, stdout=asyncio.subprocess.PIPE
    )
    out, _ = await asyncio.wait_for(process.communicate(), 2 * PATIENCE)
    assert (process.returncode, out) == (0, b"True\n")
