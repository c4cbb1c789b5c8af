"""Tasks go on where they were when their server is killed: no call is made twice, what was under way is reported."""

from __future__ import annotations

import asyncio
import contextlib
import sqlite3
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
import pytest_asyncio

from roboglot.model.clock import RealClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine import journal
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Answer
from roboglot.programs.engine.journal import Journal, does_something, header_of
from roboglot.programs.stores import JournalEntry, StoredProgram
from roboglot.programs.tasks.service import ProgramService
from roboglot.storage.database import Database
from roboglot.storage.journals import DatabaseJournalStore
from roboglot.storage.programs import program_stores
from roboglot.testing.process import child

TEXTS = dict.fromkeys(("maker", "model", "serial", "hardware_version", "software_version"), "")
UNKNOWN = Description(**TEXTS, radius=0.2, height=0.3)

PROGRAM = """import random
began = time.monotonic()
for i in range(3):
    cyberdog.task.block('b' + str(i))
    cyberdog.task.start()
    print('step', i, random.randint(1, 10**9))
cyberdog.set_log(True)
time.sleep(1000)
result = cyberdog.motion.turn(90)
print('turned', result.response.code, result.state.describe)
try:
    print('motion:', cyberdog.motion.state.describe)
    choreographer.moonwalk(0.05, 0.0, 0.05, 1)
except RobotError as error:
    print('caught', error)
print('end', time.monotonic() >= began)
"""
CUT_OFF = "the server ended while {} was under way; it was not repeated"
# First life: runs the task until it is killed, and prints its log.
SERVER = """
# warm
import asyncio, sys
from pathlib import Path
from roboglot.model.clock import RealClock
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from roboglot.programs.stores import StoredProgram

async def main():
    robot = Robot("a", None, RealClock())
    robot.actions.start("hum", lambda action: asyncio.Event().wait(), resources=["speaker"])  # who speaks has to wait
    service = ProgramService(robot, Engine(), program_stores(Database(Path(sys.argv[1])), "a"))
    service.start()
    service.log_entries.join(lambda id, entry: print(entry.text, flush=True))
    await service.save(StoredProgram("t", "", "", "single", "now", sys.argv[2], ""))
    await service.run("t")
    await asyncio.Event().wait()

asyncio.run(main())
"""


def first_life(path: Path, program: str, until: str, under_way: str = "") -> list[str]:
    """Return the task's output up to the text at which its server was killed, or until a call is ``under_way``."""
    written = []
    with child(SERVER, str(path), program) as server:
        assert server.stdout
        for line in server.stdout:
            written.append(line.rstrip("\n"))
            if line.startswith(until):
                while under_way and not is_under_way(path, under_way) and server.poll() is None:
                    time.sleep(0.02)
                time.sleep(0.2)  # answers are written a moment later
                break
        server.kill()
    return written


def is_under_way(path: Path, call: str) -> bool:
    with contextlib.closing(sqlite3.connect(path)) as connection:
        query = "SELECT count(*) FROM program_call WHERE name = ? AND answer IS NULL"
        return connection.execute(query, (call,)).fetchone() == (1,)


@pytest_asyncio.fixture
async def second(tmp_path: Path) -> AsyncIterator[Callable[[], ProgramService]]:
    """Servers on the same file, after the first has died."""
    opened: list[tuple[ProgramService, Database]] = []
    async with Engine() as engine:

        def begin() -> ProgramService:
            database = Database(tmp_path / "robot.db")
            service = ProgramService(Robot("a", UNKNOWN, RealClock(5000.0)), engine, program_stores(database, "a"))
            opened.append((service, database))
            service.start()
            return service

        yield begin
        for service, database in opened:
            await service.close()
            database.close()


async def texts(service: ProgramService) -> list[str]:
    return [entry.text for entry in await service.log("t")]


async def whole_log(service: ProgramService) -> list[str]:
    """Return the log once it is complete: its last words are written after the end of the run."""
    async with asyncio.timeout(60):
        while (log := await texts(service))[-1] != "end True":  # noqa: ASYNC110
            await asyncio.sleep(0.005)
    return log


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


async def test_task_goes_on_where_its_server_was_killed(second: Callable[[], ProgramService], tmp_path: Path) -> None:
    written = first_life(tmp_path / "robot.db", PROGRAM, "step 2")
    service = second()
    reported: list[tuple[str, str]] = []  # to a front end that reconnected before the program was back
    leave = service.reports.join(lambda report: reported.append((report.describe, service._runs["t"].block)))
    await until(lambda: reported)
    leave()
    assert reported == [("Task loop feedback, now state is suspend", "b2")]
    assert service._runs["t"]._run.suspended
    assert service._runs["t"].block == "b2"
    assert sum("it is suspended: recover it" in text for text in await texts(service)) == 1
    printed = [text for text in await texts(service) if text.startswith("step")]
    assert printed == written[: len(printed)]
    await service.recover("t")
    log = await whole_log(service)
    assert [text for text in log if text.startswith("step")] == written
    assert any(text.startswith("cyberdog.motion.turn(90): this robot has no") for text in log)  # set_log is still on
    await until(lambda: not service._journals.headers_now())


@pytest.mark.parametrize("call", ["cyberdog.motion.turn", "choreographer.moonwalk"])
async def test_unfinished_motion_is_reported_and_not_repeated(
    second: Callable[[], ProgramService], tmp_path: Path, call: str
) -> None:
    """A result with a state reports it, and the program goes on; without one, the call raises."""
    first_life(tmp_path / "robot.db", PROGRAM, "step 2")
    database = Database(tmp_path / "robot.db")
    store = DatabaseJournalStore(database, "a")
    entries = await store.entries("t")
    assert [entry.name for entry in entries].count("cyberdog.task.start") == 3
    record = b'{"$":"record","t":"State","v":{"code":1,"describe":"%s"}}'
    turned = b'{"$":"record","t":"MotionServoCmdResponse","v":{"state":%s}}' % (record % b"no legs")
    answers: list[tuple[str, bytes | None]] = [("time.sleep", b"null"), ("cyberdog.motion.turn", turned)]
    if call == "choreographer.moonwalk":
        answers.append(("cyberdog.motion.state", record % b"no legs"))
    else:
        answers.pop()
    rows = [*((name, b'{"t":"value","value":%s}' % (value or b"")) for name, value in answers), (call, None)]
    await store.write("t", [JournalEntry(len(entries) + number, *row) for number, row in enumerate(rows)])
    database.close()
    service = second()
    await until(lambda: "t" in service._runs and service._runs["t"]._run.suspended)
    assert any(f"during {call}: it is not repeated" in text for text in await texts(service))
    assert call.rpartition(".")[2] in PROGRAM.splitlines()[service._runs["t"].line - 1]
    await service.recover("t")
    log = await whole_log(service)
    words = CUT_OFF.format(call)
    if call == "cyberdog.motion.turn":
        assert f"turned 3029 {words}" in log
        assert f"motion: {words}" in log
        assert f"cyberdog.motion.turn(90): {words}" in log
    else:
        assert f"caught {words}" in log


async def test_killed_motion_fails_and_the_program_continues(
    second: Callable[[], ProgramService], tmp_path: Path
) -> None:
    program = """print('speaks')
result = cyberdog.audio.play('hello')
print(result.state.code == StateCode.spin_future_interrupted, result.response.status, result.state.describe)
print('end', True)
"""
    first_life(tmp_path / "robot.db", program, "speaks", under_way="cyberdog.audio.play")
    service = second()
    await until(lambda: "t" in service._runs and service._runs["t"]._run.suspended)
    assert service._runs["t"].line == 2
    assert sum("during cyberdog.audio.play: it is not repeated" in text for text in await texts(service)) == 1
    await service.recover("t")
    assert f"True 1 {CUT_OFF.format('cyberdog.audio.play')}" in await whole_log(service)
    await until(lambda: not service._journals.headers_now())


async def test_a_journal_knows_what_was_under_way(tmp_path: Path) -> None:
    database = Database(":memory:")
    store = DatabaseJournalStore(database, "a")
    first = Journal(store, "t")
    header = header_of("pass", {"m": "def f(): pass"}, 3600)
    await first.open(header)
    await first.begin("time.sleep")
    assert await store.entries("t") == []  # it only reads: nothing to acknowledge
    first.answered("time.sleep", b'{"t":"value","value":null}')
    await first.begin("cyberdog.motion.turn")
    assert [(entry.name, entry.answer is None) for entry in await store.entries("t")] == [
        ("time.sleep", False),
        ("cyberdog.motion.turn", True),
    ]
    second = Journal(store, "t")
    history = await second.reopen(store.headers_now()["t"])
    assert (history.header, history.interrupted) == (header, "cyberdog.motion.turn")
    slept = Answer("time.sleep", b'{"t":"value","value":null}')
    assert list(history.answers) == [slept, Answer("cyberdog.motion.turn", None)]
    assert await Journal(store, "t").reopen(store.headers_now()["t"]) == history  # not answered yet
    second.answered("cyberdog.motion.turn", b"{}")
    await second.begin("cyberdog.motion.go_straight")
    third = await Journal(store, "t").reopen(store.headers_now()["t"])
    turned = Answer("cyberdog.motion.turn", b"{}")
    assert list(third.answers) == [slept, turned, Answer("cyberdog.motion.go_straight", None)]
    await second.close()
    assert (store.headers_now(), await store.entries("t")) == ({}, [])
    database.close()


async def test_run_that_becomes_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    database = Database(":memory:")
    store = DatabaseJournalStore(database, "a")
    kept = Journal(store, "t")
    await kept.open(header_of("pass", {}, 0))
    monkeypatch.setattr(journal, "CALLS_MAX", 3)
    for _ in range(5):
        await kept.begin("cyberdog.motion.turn")
        kept.answered("cyberdog.motion.turn", b"{}")
    await kept.begin("cyberdog.motion.turn")
    assert not kept.kept
    assert store.headers_now() == {}
    database.close()


@pytest.mark.parametrize(
    ("name", "acts"),
    [
        ("cyberdog.motion.turn", True),
        ("cyberdog.audio.play", True),
        ("dancer.dance", True),
        ("cyberdog.gesture.turn_on_recognition", True),
        ("time.sleep", False),
        ("cyberdog.bms.data", False),
        ("cyberdog.imu.get_data", False),
        ("cyberdog.block", False),
        ("cyberdog.motion.state", False),
    ],
)
def test_reading_calls_may_be_repeated(name: str, acts: bool) -> None:
    assert does_something(name) is acts


async def test_a_task_that_is_new_has_no_past(second: Callable[[], ProgramService]) -> None:
    """A second run of a task starts from the beginning, with nothing of the first."""
    service = second()
    for _ in range(2):
        await service.save(StoredProgram("t", "", "", "single", "now", "cyberdog.task.start()\nprint('once')", ""))
        await service.run("t")
        await until(lambda: "t" not in service._runs)
    assert (await texts(service)).count("once") == 2
