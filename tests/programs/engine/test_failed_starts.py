"""Failures between the wish to run a program and its first line: reported, nothing is left, the next one runs."""

from __future__ import annotations

import asyncio
import errno
import os
import signal
import socket
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import closing

import pytest
import pytest_asyncio

from roboglot.model.clock import RealClock
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.errors import CannotExecute, StoreError
from roboglot.programs.stores import StoredProgram, Stores
from roboglot.programs.tasks import runner
from roboglot.programs.tasks.reports import TaskReport
from roboglot.programs.tasks.service import ProgramService
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from tests.programs.engine.test_held_runs import UNKNOWN
from tests.programs.playing import until

pytestmark = pytest.mark.asyncio(loop_scope="module")
Broken = Callable[[pytest.MonkeyPatch, Engine, Stores], None]


class Counting(RealClock):
    """Says what it is held for."""

    def __init__(self) -> None:
        super().__init__()
        self.held: set[object] = set()

    def hold(self, work: object, seconds: float = 5.0) -> None:  # noqa: ARG002
        self.held.add(work)

    def release(self, work: object) -> None:
        self.held.discard(work)


@pytest.fixture
def stores() -> Iterator[Stores]:
    with closing(Database(":memory:")) as database:
        yield program_stores(database, "a")


@pytest_asyncio.fixture(loop_scope="module")
async def service(engine: Engine, stores: Stores) -> AsyncIterator[ProgramService]:
    made = ProgramService(Robot("a", UNKNOWN, Counting()), engine, stores)
    made.start()
    await made.save(StoredProgram("t", "", "", "single", "now", "print('one')\n", ""))
    yield made
    await made.close()


def fails(error: BaseException) -> Callable[..., object]:
    def fail(*_args: object, **_kwargs: object) -> object:
        raise error

    return fail


def fails_later(error: BaseException) -> Callable[..., object]:
    async def fail(*_args: object, **_kwargs: object) -> object:
        await asyncio.sleep(0)
        raise error

    return fail


FULL, CROWDED = StoreError("the disk is full"), OSError(errno.EMFILE, "Too many open files")
FAULTS: dict[str, Broken] = {
    "journal refused": lambda patch, _, stores: patch.setattr(stores.journals, "begin", fails_later(FULL)),
    "journal broken": lambda patch, _, stores: patch.setattr(stores.journals, "begin", fails_later(OSError(5, "bad"))),
    "journal refused at once": lambda patch, _, stores: patch.setattr(stores.journals, "begin", fails(FULL)),
    "journal not removed": lambda patch, _, stores: (
        patch.setattr(stores.journals, "begin", fails_later(FULL)),
        patch.setattr(stores.journals, "remove", fails_later(FULL)),
    )[0],
    "state not written": lambda patch, _, stores: (
        patch.setattr(stores.journals, "begin", fails_later(FULL)),
        patch.setattr(stores.tasks, "set_state", fails_later(FULL)),
    )[0],
    "no memory file": lambda patch, *_: patch.setattr(os, "memfd_create", fails(CROWDED)),
    "no socket": lambda patch, *_: patch.setattr(socket, "socketpair", fails(CROWDED)),
    "no host": lambda patch, *_: patch.setattr(runner, "TaskRun", fails(MemoryError())),
    "no sources": lambda patch, *_: patch.setattr(runner, "header_of", fails(KeyError("m"))),
}


@pytest.mark.parametrize("fault", FAULTS)
async def test_a_start_that_fails_leaves_nothing(
    service: ProgramService, engine: Engine, stores: Stores, fault: str
) -> None:
    """Forked or not: no process, no journal, no held clock; and the task runs the next time."""
    clock = service.robot.clock
    assert isinstance(clock, Counting)
    busy, files = engine._busy, len(os.listdir("/proc/self/fd"))
    with pytest.MonkeyPatch.context() as patch:
        FAULTS[fault](patch, engine, stores)
        with pytest.raises(CannotExecute, match=r"\w"):
            await service.run("t")
    await until(lambda: engine.running == 0 and engine._busy == busy)
    assert service._runs == {}
    assert clock.held == set()
    assert len(os.listdir("/proc/self/fd")) <= files
    if fault == "state not written":
        await service.shutdown(["t"])
    if fault != "journal not removed":
        assert stores.journals.headers_now() == {}
    await ended(service)


async def test_a_store_that_fails_after_the_fork(service: ProgramService, stores: Stores) -> None:
    """The program runs to its end and says so; only what is written down lacks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stores.tasks, "set_state", fails_later(FULL))
        await ended(service)
    await service.shutdown(["t"])
    await ended(service)


async def test_a_zygote_killed_at_a_fork(service: ProgramService, engine: Engine) -> None:
    launcher = await engine._zygote()
    os.kill(launcher.pid, signal.SIGSTOP)
    starting = asyncio.ensure_future(service.run("t"))
    await until(lambda: engine._busy > 0)
    os.kill(launcher.pid, signal.SIGKILL)
    (refused,) = await asyncio.gather(starting, return_exceptions=True)
    assert isinstance(refused, CannotExecute)
    await until(lambda: engine._busy == 0)
    await ended(service)


async def ended(service: ProgramService) -> None:
    """Run it once more, to its end."""
    heard: list[TaskReport] = []
    leave = service.reports.join(heard.append)
    await service.run("t")
    await until(lambda: "stop task" in [report.describe for report in heard])
    leave()
    assert [report.describe for report in heard if report.error is None] == ["start task", "stop task"]
