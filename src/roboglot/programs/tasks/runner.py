"""Starts and ends tasks, and stores their states. Knows no schedule.

The caller decides which operations are allowed, and holds the lock meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection, Coroutine, Sequence
from dataclasses import replace
from datetime import datetime, tzinfo
from zlib import crc32

from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine, EngineError, EngineSilent, SandboxUnavailable
from roboglot.programs.engine.events import Answer, ExitReason, Limits, Stops
from roboglot.programs.engine.journal import Header, Journal, header_of
from roboglot.programs.errors import CannotExecute, EngineTimeout, ProgramError, StoreError
from roboglot.programs.functions import ability_set
from roboglot.programs.library.library import ModuleLibrary
from roboglot.programs.stores import LogEntry, StoredProgram, Stores
from roboglot.programs.tasks.reports import Insight, Listeners, NewestRun, Pace, TaskReport, done
from roboglot.programs.tasks.robot_modes import end_wait
from roboglot.programs.tasks.states import DEBUG, TaskOperation, TaskState, state_after
from roboglot.programs.tasks.task_run import Outcome, RunListeners, TaskRun, in_units
from roboglot.values import dataclass

log = logging.getLogger(__name__)
EXPECTED = (SandboxUnavailable, EngineError, ValueError, LookupError, ProgramError, StoreError)
RUNS_MAX = 100  # tasks running or suspended at once


class Background:
    """Tasks that are awaited only on shutdown."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[None]] = set()

    def add(self, work: Coroutine[None, None, None], name: str) -> None:
        """Start ``work``."""
        task = asyncio.create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def done(self) -> None:
        """Wait for all tasks."""
        await asyncio.gather(*self._tasks)


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Settings of every run: its limits, and the time zone that its ``time.localtime`` shows."""

    limits: Limits
    zone: tzinfo


class Runner:
    """Starter and supervisor of runs.

    ``runs``: running and suspended tasks by id; ``stops``: breakpoints of later starts by the task's id.
    ``newest``: what is kept of the newest run of each task since the server's start.
    ``ended`` is called with each ended task and its new state.
    """

    def __init__(
        self,
        robot: Robot,
        engine: Engine,
        stores: Stores,
        library: ModuleLibrary,
        lock: asyncio.Lock,
        *,
        settings: RunSettings,
        ended: Callable[[StoredProgram, TaskState], None],
    ) -> None:
        self.runs: dict[str, TaskRun] = {}
        self.stops: dict[str, Stops] = {}
        self.newest: dict[str, NewestRun] = {}
        self.reports = Listeners[[TaskReport]]()
        self.log_entries = Listeners[[str, LogEntry]]()
        self.pace, self.log_pace = Pace(), Pace()
        self.insights = Listeners[[Insight]]()
        self._robot = robot
        self._engine = engine
        self._store = stores.tasks
        self._journals = stores.journals
        self._library = library
        self._lock = lock
        self._settings = settings
        self._ended = ended
        self._supervisors = Background()

    async def done(self) -> None:
        """Wait until every ended run is stored."""
        await self._supervisors.done()

    async def check_startable(self, uses: Collection[str]) -> None:
        """Raise ProgramError if a task with these modules could not be started now."""
        if len(self.runs) >= RUNS_MAX:
            raise CannotExecute(f"{RUNS_MAX} tasks are running already")
        await self._library.sources(uses)

    async def start(self, task: StoredProgram, uses: Collection[str]) -> None:
        """Start a task in run_wait; its reports come after those of the caller. Raises ProgramError."""
        here = datetime.fromtimestamp(self._robot.clock.epoch(), self._settings.zone).utcoffset()
        journal = Journal(self._journals, task.id)
        clock = self._robot.clock
        with clock.holding():
            try:
                modules = await self._library.sources(uses)
                stops = self.stops.get(task.id, Stops() if task.id == DEBUG else None)
                offset = int(here.total_seconds()) if here else 0
                seed = crc32(f"{task.id} {clock.time()}".encode()) if clock.repeats else None
                header = header_of(task.body, modules, offset, watched=stops is not None, seed=seed)
                living = await self._begin(task, header, journal, stops)
            except Exception as error:  # noqa: BLE001 - after any failure the task is as if it had ended
                state = TaskState.RUN_WAIT if task.mode == "cycle" else TaskState.SHUTDOWN
                words = _reason(error)
                await self._give_back(task.id, state, words, journal)
                raise (EngineTimeout if isinstance(error, EngineSilent) else CannotExecute)(words) from None
            living.time.begin()
        self._supervisors.add(self._supervise(living), f"task {task.id}")

    async def _begin(self, task: StoredProgram, header: Header, journal: Journal, stops: Stops | None) -> TaskRun:
        """Fork while the journal is written; the program's events wait for both."""
        opening = asyncio.ensure_future(journal.open(header))
        try:
            living = await self._living(task, header, journal, stops=stops)
        except BaseException:
            await asyncio.gather(opening, return_exceptions=True)
            raise
        try:
            await opening
        except BaseException:
            del self.runs[task.id]
            await living.kill()
            raise
        return living

    async def _give_back(self, id: str, state: TaskState, words: str, journal: Journal) -> None:
        """Store the state of a program that did not start; a failure of the store is only logged."""
        note = LogEntry(self._robot.clock.epoch(), "error", words)
        for step in (self._store.set_state(id, state, [note]), journal.close()):
            try:
                await step
            except StoreError as error:
                log.warning("cannot store that task %s did not start: %s", id, error)

    async def revive(self, task: StoredProgram, header: str) -> None:
        """Restore a task that was running or suspended when the server was killed; suspend it at the same place."""
        journal = Journal(self._journals, task.id)
        try:
            history = await journal.reopen(header)
            stops = Stops(watched=True) if history.header.watched else None
            living = await self._living(task, history.header, journal, history.answers, stops)
        except Exception as error:  # noqa: BLE001 - as above
            words = f"the server ended while the task was under way; it cannot go on: {_reason(error)}"
            state = state_after(TaskState.SUSPEND, TaskOperation.SHUTDOWN, task.mode)
            await self._give_back(task.id, state, words, journal)
            return
        await living.revive()
        living.log.write("note", "the program is replayed up to where it was: what it had printed is printed again")
        if history.interrupted:
            living.log.write("error", f"the server ended during {history.interrupted}: it is not repeated")
        self._supervisors.add(self._supervise(living), f"task {task.id}")

    async def _living(
        self,
        task: StoredProgram,
        header: Header,
        journal: Journal,
        answers: Sequence[Answer] = (),
        stops: Stops | None = None,
    ) -> TaskRun:
        run = await self._engine.start(
            header.body,
            replace(ability_set(), utc_offset=header.utc_offset),
            self._settings.limits,
            modules=header.modules,
            seed=header.seed,
            history=answers,
            stops=in_units(stops) if stops else None,
        )
        listeners = RunListeners(
            report=self.reports.publish,
            logged=self.log_entries.publish,
            at_breakpoint=lambda: self._at_breakpoint(living),
            insights=self.insights,
            pace=self.pace,
            log_pace=self.log_pace,
        )
        try:
            replaying = len(answers)
            living = TaskRun(
                task, run, self._robot, listeners=listeners, journal=journal, replaying=replaying, stops=stops
            )
        except BaseException:
            await run.kill()  # no client could know of it
            raise
        self.runs[task.id] = living
        self.newest[task.id] = living.lasting
        return living

    async def end(self, id: str, *, why: str) -> TaskState:
        """Kill a run and store the state of its task."""
        run = self.runs[id]
        await run.kill()
        run.log.write("note", why)
        state = await self._put_away(run, run.state, TaskOperation.SHUTDOWN)
        run.host.end_block()
        return state

    async def suspend(self, run: TaskRun) -> None:
        """Suspend a run and report it."""
        with self._robot.clock.holding():
            await run.suspend()
            run.state = TaskState.SUSPEND
            await self._store.set_state(run.task.id, run.state, run.log.take())
        self.reports.publish(done(TaskOperation.SUSPEND, run.task.id, run.state))

    async def recover(self, run: TaskRun, step: Callable[[], None] | None = None) -> None:
        """Continue a run and report it; ``step`` sets the next halt."""
        end_wait(self._robot)
        run.state = TaskState.RUN
        if step:
            step()
        with self._robot.clock.holding():
            await self._store.set_state(run.task.id, run.state)
        # Report first: a resumed program may halt at a block before this coroutine runs again.
        self.reports.publish(done(TaskOperation.RECOVER, run.task.id, run.state))
        await run.resume()

    async def _supervise(self, run: TaskRun) -> None:
        """Follow a run from start to stop, unless it is ended meanwhile."""
        id = run.task.id
        async with self._lock:
            if self.runs.get(id) is run and run.state is TaskState.RUN_WAIT:
                run.state = TaskState.RUN
                try:
                    await self._store.set_state(id, run.state)
                except StoreError as error:
                    log.warning("cannot store that task %s runs: %s", id, error)
                self.reports.publish(TaskReport(id, TaskOperation.START, "start task"))
        try:
            outcome = await run.execute()
            async with self._lock:
                if self.runs.get(id) is run:
                    await self._finish(run, outcome)
        finally:
            run.time.end()

    async def _finish(self, run: TaskRun, outcome: Outcome) -> None:
        """Store and report the end of a program."""
        id = run.task.id
        for words in filter(None, (outcome.error, run.control.summary)):
            run.log.write("error", words)
        try:
            await self._put_away(run, TaskState.RUN, TaskOperation.STOP)
        except StoreError as error:
            log.warning("cannot store the end of task %s: %s", id, error)
        if outcome.reason is not ExitReason.FINISHED:
            self.reports.publish(TaskReport(id, TaskOperation.RUN, outcome.error, CannotExecute(outcome.error)))
        elif words := run.control.summary:
            self.reports.publish(TaskReport(id, TaskOperation.RUN, words, CannotExecute(words)))
        run.host.end_block()
        self.reports.publish(TaskReport(id, TaskOperation.STOP, "stop task"))

    async def _put_away(self, run: TaskRun, before: TaskState, operation: TaskOperation) -> TaskState:
        """Store and return the state of a task whose program is gone; its mode may have changed meanwhile."""
        id = run.task.id
        self.runs.pop(id, None)
        task = await self._store.get(id) or run.task
        state = state_after(before, operation, task.mode)
        try:
            await self._store.set_state(id, state, run.log.take())
        finally:
            self._ended(task, state)
            await run.close_journal()
        return state

    async def _at_breakpoint(self, run: TaskRun) -> None:
        async with self._lock:
            if self.runs.get(run.task.id) is run and run.state is TaskState.RUN:
                await self.suspend(run)


def _reason(error: Exception) -> str:
    """Return why a program did not start; unexpected errors also go to the server's log."""
    if not isinstance(error, EXPECTED):
        log.error("cannot start a program", exc_info=error)
    return str(error) or type(error).__name__
