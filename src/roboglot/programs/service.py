"""The tasks of one robot: saved, run, debugged, suspended, continued, ended, deleted, as the manual's tables allow.

What is to be acknowledged is in the store first. Knows no frame and no socket: doors call it, and listen to its
reports.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from roboglot.model.robot import Robot
from roboglot.programs.engine import Engine, EngineError, SandboxUnavailable
from roboglot.programs.events import ExitReason
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.language import Problem
from roboglot.programs.reports import Refusal, Report, TaskReport
from roboglot.programs.robot_modes import ALLOWED, mode_of
from roboglot.programs.runs import Outcome, TaskRun
from roboglot.programs.tasks import TaskOperation, TaskState, next_state
from roboglot.storage.database import Database
from roboglot.storage.programs import LogEntry, ProgramStore, StoredProgram
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.conditions import BadCondition, parse_moment
from roboglot.wire.visual.requests import CONDITIONS, DEBUG

log = logging.getLogger(__name__)

TASKS_MAX = 10_000
RUNS_MAX = 100  # tasks running or suspended at once
PROBLEMS_SHOWN = 3


class ProgramService:
    """Built on start-up; settles what a crash left behind, in place. ``close`` ends every run."""

    def __init__(self, robot: Robot, engine: Engine, database: Database) -> None:
        self.robot = robot
        self._engine = engine
        self._store = ProgramStore(database, robot.id)
        self._prelude = ability_set()
        self._runs: dict[str, TaskRun] = {}
        self._supervisors: set[asyncio.Task[None]] = set()
        self._listeners: list[Report] = []
        # Changes of state happen one after the other; what takes long (checking a body) happens before.
        self._lock = asyncio.Lock()
        self._settle()

    def subscribe(self, listener: Report) -> Callable[[], None]:
        """Hear what happens to tasks by itself; returns what ends it. Listeners must be quick and must not raise."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def start(self) -> None:
        """Warm the engine up in the background, so that the first program starts as fast as the others."""
        self._engine.open_soon()

    async def close(self) -> None:
        """End every run; the tasks are as if a user had ended them."""
        for id in tuple(self._runs):
            async with self._lock:
                if id in self._runs:
                    await self._end(id, "the server was stopped")
        await asyncio.gather(*self._supervisors)

    def allow(self, operation: TaskOperation) -> None:
        """Raise Refusal if the robot's mode forbids ``operation`` (0.2.2.3)."""
        mode = mode_of(self.robot)
        if operation not in ALLOWED[mode]:
            raise Refusal(
                FeedbackState.ILLEGAL,
                f"The current robot is in [{mode}] mode and does not support <{operation}> operation.",
            )

    async def tasks(self, ids: Collection[str] = ()) -> list[StoredProgram]:
        """Those of ``ids`` that exist, or all, by id; the debug task is nobody's business."""
        self.allow(TaskOperation.INQUIRY)
        return [task for task in await self._store.all(ids) if task.id != DEBUG]

    async def log(self, id: str) -> list[LogEntry]:
        """What the task printed and what became of it, oldest first."""
        await self._write_log(id)
        return await self._store.log(id)

    async def check(self, body: str) -> list[Problem]:
        """What is wrong with a program; raises Refusal where that cannot be found out."""
        try:
            return await self._engine.check(body, self._prelude)
        except ValueError as error:
            raise Refusal(FeedbackState.BAD_BODY, str(error)) from None
        except (SandboxUnavailable, EngineError) as error:
            raise Refusal(FeedbackState.OTHER, str(error)) from None

    async def save(self, task: StoredProgram) -> None:
        """Add or replace a task (its ``state`` is not looked at). One that is wrong is kept, too, and refused."""
        await self._check_table(TaskOperation.SAVE, task.id)
        problems = await self.check(task.body)
        async with self._lock:
            await self._keep(task, TaskOperation.SAVE, correct=not problems)
        _refuse_wrong(problems)

    async def debug(self, task: StoredProgram) -> None:
        """Save under the id debug and run at once; a debug run before this one is ended."""
        self.allow(TaskOperation.DEBUG)
        problems = await self.check(task.body)
        async with self._lock:
            if DEBUG in self._runs:
                await self._end(DEBUG, "another debug run took over")
            kept = await self._keep(
                replace(task, id=DEBUG, mode="single", condition="now"),
                TaskOperation.DEBUG,
                correct=not problems,
            )
            _refuse_wrong(problems)
            await self._start(kept)

    async def run(self, id: str, mode: str = "", condition: str = "") -> None:
        """Run a saved task; ``mode`` and ``condition``, where given, replace what is stored."""
        async with self._lock:
            state = await self._check_table(TaskOperation.RUN, id)
            task = await self._store.get(id)
            assert task is not None, "the table refuses to run what does not exist"
            task = replace(task, mode=mode or task.mode, condition=condition or task.condition)
            try:
                CONDITIONS[task.mode](task.condition)
            except BadCondition as error:
                raise Refusal(FeedbackState.BAD_CONDITION, f"condition: {error}") from None
            if state is TaskState.RUN:  # no second instance; what changed counts the next time
                await self._store.put(task)
                return
            if task.mode != "single" or not parse_moment(task.condition).immediate:
                raise Refusal(FeedbackState.OTHER, "the schedule is not built yet: only single tasks run, and only now")
            if len(self._runs) >= RUNS_MAX:
                raise Refusal(FeedbackState.CANNOT_EXECUTE, f"{RUNS_MAX} tasks are running already")
            task = replace(task, state=TaskState.RUN_WAIT)
            await self._store.put(task)
            await self._start(task)

    async def refusal(self, operation: TaskOperation, id: str) -> Refusal | None:
        """Why ``operation`` would not be done now, or None."""
        try:
            await self._check_table(operation, id)
        except Refusal as refusal:
            return refusal
        return None

    async def suspend(self, id: str) -> None:
        """Stop the program and the robot's motion for it, wherever they are."""
        async with self._lock:
            await self._check_table(TaskOperation.SUSPEND, id)
            await self._suspend(self._runs[id])

    async def recover(self, id: str) -> None:
        """Let both go on."""
        async with self._lock:
            await self._check_table(TaskOperation.RECOVER, id)
            run = self._runs[id]
            run.state = TaskState.RUN
            await self._store.set_state(id, run.state)
            await run.resume()
            self._tell_done(TaskOperation.RECOVER, id, run.state)

    async def shutdown(self, id: str) -> None:
        """End the program at once and call off what it does on the robot."""
        async with self._lock:
            before = await self._check_table(TaskOperation.SHUTDOWN, id)
            if id in self._runs:
                state = await self._end(id, "ended by the user")
            else:
                task = await self._store.get(id)
                state = _after(before, TaskOperation.SHUTDOWN, task.mode if task else "")
                await self._store.set_state(id, state)
            self._tell_done(TaskOperation.SHUTDOWN, id, state)

    async def delete(self, id: str) -> None:
        """Forget a task and its log; nothing to do for one that does not exist."""
        async with self._lock:
            await self._check_table(TaskOperation.DELETE, id)
            await self._store.remove(id)

    def _settle(self) -> None:
        """What ran when the server died does not run any more."""
        left = self._store.in_states_now([TaskState.RUN, TaskState.SUSPEND])
        left += [task for task in self._store.in_states_now([TaskState.RUN_WAIT]) if task.mode == "single"]
        states = {task.id: "run_wait" if task.mode == "cycle" else "shutdown" for task in left}
        if states:
            log.warning("%d tasks were lost when the server ended: %s", len(states), ", ".join(states)[:500])
            note = "the server ended while the task was under way; it was not continued"
            self._store.settle_now(states, LogEntry(self.robot.clock.epoch(), "error", note))

    async def _check_table(self, operation: TaskOperation, id: str) -> TaskState:
        """The task's present state, if the tables allow ``operation``."""
        self.allow(operation)
        if (run := self._runs.get(id)) is not None:
            state = run.state
        else:
            task = await self._store.get(id)
            state = TaskState(task.state) if task else TaskState.NULL
            if state.alive:  # its end could not be written down
                state = TaskState.SHUTDOWN
        if next_state(state, operation) is None:
            raise Refusal(FeedbackState.ILLEGAL, f"The current operation({operation}) is illegal: {id} is in {state}.")
        return state

    async def _keep(self, task: StoredProgram, operation: TaskOperation, *, correct: bool) -> StoredProgram:
        state = await self._check_table(operation, task.id)
        if state is TaskState.NULL and await self._store.count() >= TASKS_MAX:
            raise Refusal(FeedbackState.CANNOT_REGISTER, f"{TASKS_MAX} tasks are stored already")
        kept = replace(task, state=_after(state, operation, task.mode, correct=correct))
        await self._store.put(kept)
        return kept

    async def _start(self, task: StoredProgram) -> None:
        """Bring a task in run_wait to life; its own news come after the caller's."""
        try:
            run = await self._engine.start(task.body, self._prelude)
        except (SandboxUnavailable, EngineError, ValueError) as error:
            note = LogEntry(self.robot.clock.epoch(), "error", str(error))
            await self._store.set_state(task.id, TaskState.SHUTDOWN, [note])
            raise Refusal(FeedbackState.CANNOT_EXECUTE, str(error)) from None
        living = TaskRun(task, run, self.robot, report=self._tell, at_breakpoint=lambda: self._at_breakpoint(living))
        self._runs[task.id] = living
        supervisor = asyncio.create_task(self._supervise(living), name=f"task {task.id}")
        self._supervisors.add(supervisor)
        supervisor.add_done_callback(self._supervisors.discard)

    async def _supervise(self, run: TaskRun) -> None:
        """From start to stop, unless somebody ends it in between."""
        id = run.task.id
        async with self._lock:
            if self._runs.get(id) is run:
                run.state = TaskState.RUN
                await self._store.set_state(id, run.state)
                self._tell(TaskReport(id, TaskOperation.START, 0, "start task"))
        outcome = await run.execute()
        async with self._lock:
            if self._runs.get(id) is run:
                await self._finish(run, outcome)

    async def _finish(self, run: TaskRun, outcome: Outcome) -> None:
        """The program ended by itself, well or badly."""
        id = run.task.id
        if outcome.error:
            run.write("error", outcome.error)
        state = _after(TaskState.RUN, TaskOperation.STOP, run.task.mode)
        await self._store.set_state(id, state, run.take_log())
        del self._runs[id]
        if outcome.reason is not ExitReason.FINISHED:
            self._tell(TaskReport(id, TaskOperation.RUN, FeedbackState.CANNOT_EXECUTE, outcome.error))
        run.end_block()
        self._tell(TaskReport(id, TaskOperation.STOP, 0, "stop task"))

    async def _end(self, id: str, why: str) -> TaskState:
        """Kill a run and write down what is left of its task."""
        run = self._runs[id]
        await run.kill()
        del self._runs[id]
        run.write("note", why)
        state = _after(run.state, TaskOperation.SHUTDOWN, run.task.mode)
        await self._store.set_state(id, state, run.take_log())
        run.end_block()
        return state

    async def _suspend(self, run: TaskRun) -> None:
        await run.suspend()
        run.state = TaskState.SUSPEND
        await self._store.set_state(run.task.id, run.state, run.take_log())
        self._tell_done(TaskOperation.SUSPEND, run.task.id, run.state)

    async def _at_breakpoint(self, run: TaskRun) -> None:
        async with self._lock:
            if self._runs.get(run.task.id) is run:
                await self._suspend(run)

    async def _write_log(self, id: str) -> None:
        if (run := self._runs.get(id)) is not None:
            await self._store.append_log(id, run.take_log())

    def _tell(self, report: TaskReport) -> None:
        for listener in tuple(self._listeners):
            listener(report)

    def _tell_done(self, operation: TaskOperation, id: str, state: TaskState) -> None:
        """The second feedback of suspend, recover and shutdown."""
        self._tell(TaskReport(id, operation, 0, f"Task loop feedback, now state is {state}"))


def _after(state: TaskState, operation: TaskOperation, mode: str, *, correct: bool = True) -> TaskState:
    """The state after a legal operation."""
    following = next_state(state, operation, mode=mode, correct=correct)
    assert following is not None, f"{state} x {operation} was allowed"
    return following


def _refuse_wrong(problems: Sequence[Problem]) -> None:
    if problems:
        shown = "; ".join(
            f"line {p.line}, column {p.column}: {p.english} {p.chinese}" for p in problems[:PROBLEMS_SHOWN]
        )
        more = f" (and {len(problems) - PROBLEMS_SHOWN} more)" if len(problems) > PROBLEMS_SHOWN else ""
        raise Refusal(FeedbackState.BAD_SYNTAX, shown + more)
