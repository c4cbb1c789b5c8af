"""Held runs: a front end finds their reported state after a crash, and nothing continues too early."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import closing
from dataclasses import replace

import pytest
import pytest_asyncio

from roboglot.model.clock import RealClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine.calls import NONE_REPLY
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Answer, Finished, Output, Replayed
from roboglot.programs.stores import JournalEntry, LogEntry, StoredProgram, Stores
from roboglot.programs.tasks.service import ProgramService
from roboglot.storage.database import Database
from roboglot.storage.journals import DatabaseJournalStore
from roboglot.storage.programs import program_stores
from tests.narrowing import of_kind
from tests.programs.playing import PRELUDE, until

TEXTS = dict.fromkeys(("maker", "model", "serial", "hardware_version", "software_version"), "")
UNKNOWN = Description(**TEXTS, radius=0.2, height=0.3)

pytestmark = pytest.mark.asyncio(loop_scope="module")
PROGRAM = "cyberdog.task.block('one')\nprint('one')\ncyberdog.task.breakpoint_block('two')\nprint('two')\n"


class SlowJournals(DatabaseJournalStore):
    """Writes nothing before the disk is ``ready``."""

    ready: asyncio.Event

    async def write(self, id: str, entries: Sequence[JournalEntry]) -> None:
        await self.ready.wait()
        await super().write(id, entries)


@pytest.fixture
def stores() -> Iterator[Stores]:
    with closing(Database(":memory:")) as database:
        journals = SlowJournals(database, "a")
        journals.ready = asyncio.Event()
        yield replace(program_stores(database, "a"), journals=journals)


@pytest_asyncio.fixture(loop_scope="module")
async def service(engine: Engine, stores: Stores) -> AsyncIterator[ProgramService]:
    made = ProgramService(Robot("a", UNKNOWN, RealClock()), engine, stores)
    made.start()
    await made.save(StoredProgram("t", "", "", "single", "now", PROGRAM, ""))
    yield made
    of_kind(stores.journals, SlowJournals).ready.set()
    await made.close()


async def test_a_halt_is_written_before_it_is_reported(service: ProgramService, stores: Stores) -> None:
    suspended = asyncio.Event()
    service.reports.join(lambda report: suspended.set() if "suspend" in report.describe else None)
    await service.run("t")
    await until(lambda: service._runs["t"].log.newest() != [])  # it has printed and reaches its breakpoint
    waiting = asyncio.ensure_future(suspended.wait())
    await asyncio.wait([waiting], timeout=0.2)
    assert not waiting.done()
    of_kind(stores.journals, SlowJournals).ready.set()
    await waiting
    assert [entry.name for entry in await stores.journals.entries("t")][:1] == ["cyberdog.task.block"]


async def test_the_log_holds_lines_of_this_moment(
    service: ProgramService, stores: Stores, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pushed lines are in the log that a client fetches, so that it does not lose them again."""
    of_kind(stores.journals, SlowJournals).ready.set()
    await service.run("t")
    run = service._runs["t"]
    await until(lambda: run.state == "suspend")
    stored = stores.tasks.log

    async def slow(id: str) -> list[LogEntry]:
        entries = await stored(id)
        run.log.write("print", "meanwhile")
        return entries

    monkeypatch.setattr(stores.tasks, "log", slow)
    assert [entry.text for entry in await service.log("t")] == ["one", "meanwhile"]


async def test_last_answer_of_earlier_life_waits(engine: Engine) -> None:
    history = [Answer("cyberdog.echo", NONE_REPLY)] * 2
    run = await engine.start("cyberdog.echo()\ncyberdog.echo()\nprint('on')\n", PRELUDE, seed=1, history=history)
    run.calls.keeps_last = True
    assert [type(await anext(run)) for _ in history] == [Replayed] * 2
    following = asyncio.ensure_future(anext(run))
    await asyncio.wait([following], timeout=0.2)
    assert not following.done()
    run.calls.go_on()
    assert await following == Output("on\n")
    assert await anext(run) == Finished()
