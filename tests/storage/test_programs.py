"""Programs and their logs in the database."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Iterator
from pathlib import Path
from threading import Event

import pytest

from roboglot.programs.stores import LOG_MAX, LOG_TEXT_MAX, LogEntry, StoredProgram
from roboglot.storage.database import Database
from roboglot.storage.programs import DatabaseProgramStore
from roboglot.storage.transactions import Connection, DatabaseError
from roboglot.testing.process import child


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    opened = Database(tmp_path / "robot.db")
    yield opened
    opened.close()


def program(id: str, state: str = "wait_run", body: str = "pass") -> StoredProgram:
    return StoredProgram(id, "describe", '{"blocks": {}}', "single", "now", body, state)


async def test_programs_are_listed_per_robot_and_kind(database: Database) -> None:
    tasks = DatabaseProgramStore(database, "a")
    for id in ("t10", "t1", "t2"):
        await tasks.put(program(id))
    await tasks.put(program("t1", body="print(1)"))
    assert [p.id for p in await tasks.all()] == ["t1", "t10", "t2"]
    assert [p.id for p in await tasks.all(["t2", "unknown", "t1", "t2"])] == ["t1", "t2"]
    assert await tasks.get("t1") == program("t1", body="print(1)")
    assert await tasks.count() == 3
    for other in (DatabaseProgramStore(database, "b"), DatabaseProgramStore(database, "a", "module")):
        assert await other.all() == []


async def test_removing_one_leaves_those_whose_id_begins_alike(database: Database) -> None:
    tasks = DatabaseProgramStore(database, "a")
    for id in ("t1", "t10"):
        await tasks.put(program(id))
        await tasks.append_log(id, [LogEntry(1.0, "print", id)])
    await tasks.remove("t1")
    await tasks.remove("t1")
    assert [p.id for p in await tasks.all()] == ["t10"]
    assert await tasks.log("t1") == []
    assert [entry.text for entry in await tasks.log("t10")] == ["t10"]


async def test_a_log_keeps_the_newest_entries(database: Database) -> None:
    tasks = DatabaseProgramStore(database, "a")
    await tasks.put(program("t"))
    await tasks.append_log("t", [LogEntry(float(i), "print", str(i)) for i in range(LOG_MAX)])
    await tasks.set_state("t", "shutdown", [LogEntry(9.0, "error", "x" * (LOG_TEXT_MAX + 1))])
    log = await tasks.log("t")
    assert len(log) == LOG_MAX
    assert (log[0].text, len(log[-1].text)) == ("1", LOG_TEXT_MAX)
    assert (await tasks.all())[0].state == "shutdown"


async def test_interrupted_tasks_are_settled_at_start(database: Database) -> None:
    tasks = DatabaseProgramStore(database, "a")
    for id, state in (("t1", "run"), ("t2", "suspend"), ("t3", "wait_run")):
        await tasks.put(program(id, state))
    assert [p.id for p in tasks.in_states_now(["run", "suspend"])] == ["t1", "t2"]
    tasks.settle_now({"t1": "shutdown", "t2": "run_wait"}, LogEntry(0.0, "error", "lost"))
    assert [p.state for p in await tasks.all()] == ["shutdown", "run_wait", "wait_run"]
    assert [entry.text for entry in await tasks.log("t2")] == ["lost"]


CHILD = """
# warm
import asyncio, sys
from roboglot.storage.database import Database
from roboglot.programs.stores import StoredProgram
from roboglot.storage.programs import DatabaseProgramStore
from roboglot.storage.transactions import Connection, DatabaseError
async def main():
    store = DatabaseProgramStore(Database(sys.argv[1]), "a")
    for number in range(10_000):
        await store.put(StoredProgram(f"t{number}", "", "", "single", "now", "pass", "wait_run"))
        print(number, flush=True)
asyncio.run(main())
"""


async def test_acknowledged_programs_survive_kill_9(tmp_path: Path) -> None:
    path = tmp_path / "robot.db"
    with child(CHILD, str(path)) as writer:
        assert writer.stdout
        acknowledged = [int(writer.stdout.readline()) for _ in range(20)]
        writer.send_signal(signal.SIGKILL)
        acknowledged += [int(line) for line in writer.stdout if line.endswith("\n")]
    database = Database(path)
    kept = {p.id for p in await DatabaseProgramStore(database, "a").all()}
    database.close()
    assert {f"t{number}" for number in acknowledged} <= kept


async def test_reading_waits_for_no_writer(tmp_path: Path) -> None:
    database, may_end = Database(tmp_path / "robot.db"), Event()
    tasks = DatabaseProgramStore(database, "a")
    await tasks.put(program("t"))

    def write_slowly(connection: Connection) -> None:
        connection.execute("DELETE FROM program")
        assert may_end.wait(60)

    writing = asyncio.ensure_future(database.run(write_slowly))
    assert await tasks.get("t") == program("t")
    assert await tasks.count() == 1
    may_end.set()
    await writing
    assert await tasks.get("t") is None
    with pytest.raises(DatabaseError, match="readonly"):
        await database.read(lambda connection: connection.execute("DELETE FROM program"))
    database.close()
