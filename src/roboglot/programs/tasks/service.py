"""The tasks of one robot: saved, run at their time, debugged, suspended, ended, deleted, as the manual's tables allow.

Changes are stored before they are acknowledged. Knows no frame and no socket: doors call it and listen to its reports.
"""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import UTC, tzinfo
from functools import partial

from roboglot.model.client_context import identity
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Limits, Stops
from roboglot.programs.errors import LimitReached, NotAllowed, ProgramError
from roboglot.programs.functions import ability_set
from roboglot.programs.language import Problem
from roboglot.programs.language.places import Step
from roboglot.programs.library.inspection import Inspector, refuse_wrong
from roboglot.programs.library.library import ModuleLibrary
from roboglot.programs.stores import LOG_MAX, ListedProgram, LogEntry, StoredProgram, Stores
from roboglot.programs.tasks.deferred_stops import DeferredStops
from roboglot.programs.tasks.owners import act_for_owner
from roboglot.programs.tasks.recovery import settle
from roboglot.programs.tasks.reports import RunFigures, TaskPosition, TaskReport, done
from roboglot.programs.tasks.robot_modes import check_mode, check_scheduled, end_wait
from roboglot.programs.tasks.runner import Background, Runner, RunSettings
from roboglot.programs.tasks.states import DEBUG, TaskOperation, TaskState, next_state, state_after
from roboglot.programs.tasks.task_run import TaskRun
from roboglot.programs.tasks.timetable import Timetable
from roboglot.programs.tasks.turns import Turns

TASKS_MAX = 10_000


class ProgramService:
    """The tasks and modules of one robot. The constructor settles tasks that a crash interrupted.

    ``reports`` publishes changes of tasks, ``log_entries`` new lines of their logs, ``insights`` results of functions
    and values of variables. Programs wait for the front ends in ``pace`` after each block, for the readers in
    ``log_pace`` after each line. ``newest``: what is kept of each task's newest run since the server's start. ``zone``
    is the time zone of conditions and of ``time.localtime``.
    """

    def __init__(
        self, robot: Robot, engine: Engine, stores: Stores, *, limits: Limits | None = None, zone: tzinfo = UTC
    ) -> None:
        self.robot = robot
        self._engine = engine
        self._store = stores.tasks
        self._journals = stores.journals
        self._inspector = Inspector(engine, ability_set)
        # Changes of state happen one at a time; slow work (checking a body) is done before taking the lock.
        self._lock = asyncio.Lock()
        self._timetable = Timetable(robot.clock, zone, lambda id, _: self._fires.add(self._fire(id), f"fire {id}"))
        self.library = ModuleLibrary(stores.modules, self._inspector, self._lock, partial(check_mode, robot))
        self._runner = Runner(
            robot,
            engine,
            stores,
            self.library,
            self._lock,
            settings=RunSettings(limits or Limits(), zone),
            ended=self._timetable.wait_again,
        )
        self.reports, self.log_entries, self.pace = self._runner.reports, self._runner.log_entries, self._runner.pace
        self.newest = self._runner.newest
        self.insights, self.log_pace = self._runner.insights, self._runner.log_pace
        self._runs = self._runner.runs
        self._fires = Background()
        self._late = DeferredStops(robot, self._runs, self._fires, self.shutdown, self.suspend)
        self._turns = Turns(robot.clock, self._lock, stores.tasks, self._runner, settle(stores, robot.clock.epoch()))

    def start(self) -> None:
        """Start the schedule: first overdue tasks and those with ``@reboot``, then the others at their time.

        The engine warms up a little later, in the background; an earlier program waits 0.2 s for it.
        """
        self._engine.open_later()
        self._turns.closed = False
        if self._turns.lost:
            self._fires.add(self._turns.restore(), "revive")
        for task in self._store.in_states_now([TaskState.RUN_WAIT]):
            if task.mode == "cycle" and task.condition.strip() == "@reboot":
                self._timetable.set(task.id, self.robot.clock.epoch())
            else:
                self._timetable.wait(task)

    async def close(self) -> None:
        """End every run; the tasks are as if a user had ended them. Scheduled tasks stay scheduled."""
        self._turns.closed = True
        self._late.close()
        self._timetable.clear()
        async with self._lock:
            for run in self._runs.values():
                run.call_off()
            await asyncio.gather(*(self._runner.end(id, why=_shut_down(run)) for id, run in tuple(self._runs.items())))
        await self._fires.done()
        await self._runner.done()
        self._timetable.clear()

    async def tasks(self, ids: Collection[str] = ()) -> list[ListedProgram]:
        """Return the existing tasks of ``ids``, or all if it is empty, by id; the debug task is hidden."""
        check_mode(self.robot, TaskOperation.INQUIRY)
        return [task for task in await self._store.all(ids) if task.id != DEBUG]

    async def log(self, id: str) -> list[LogEntry]:
        """Return the log of a task up to this moment, oldest entry first."""
        async with self._lock:  # a run that has just ended may still be writing its record
            if (run := self._runs.get(id)) is not None:
                await self._store.append_log(id, run.log.take())
            entries = await self._store.log(id)
            return (entries + run.log.newest())[-LOG_MAX:] if run else entries

    async def whereabouts(self, id: str) -> TaskPosition:
        """Return the current position of a task; line 0 and "" if it does not run."""
        if (run := self._runs.get(id)) is not None:
            place = (run.line, run.module, run.block, run.watched)
            return TaskPosition(run.state, *place, began=run.started, variables=run.variables)
        task = await self._store.get(id)
        return TaskPosition(TaskState(task.state) if task else TaskState.NULL)

    def running(self) -> list[RunFigures]:
        """Return the resources of all running or suspended tasks, by id."""
        return [self._runs[id].figures() for id in sorted(self._runs)]

    async def get(self, id: str) -> StoredProgram | None:
        """Return a task with its body."""
        return await self._store.get(id)

    async def check(self, body: str) -> list[Problem]:
        """Return the problems of a program. Raises ProgramError if it cannot be checked."""
        problems, _ = await self._inspector.inspect(body, self.library.functions)
        return problems

    async def save(self, task: StoredProgram) -> None:
        """Add or replace a task; ``state`` is ignored. A task with problems is stored, too, but raises ProgramError."""
        await self._check_table(TaskOperation.SAVE, task.id)
        problems, names = await self._inspector.inspect(task.body, self.library.functions)
        async with self._turns.take():
            uses = self.library.ids(names)
            await self._keep(
                replace(task, due=None, owner=identity()), TaskOperation.SAVE, correct=not problems, uses=uses
            )
        refuse_wrong(problems)

    async def debug(self, task: StoredProgram) -> None:
        """Save under the id debug and run at once; an earlier debug run is ended."""
        check_mode(self.robot, TaskOperation.DEBUG)
        problems, names = await self._inspector.inspect(task.body, self.library.functions)
        async with self._turns.take():
            uses = self.library.ids(names)
            if DEBUG in self._runs:
                await self._runner.end(DEBUG, why="another debug run took over")
            kept = await self._keep(
                replace(task, id=DEBUG, mode="single", condition="now", owner=identity()),
                TaskOperation.DEBUG,
                correct=not problems,
                uses=(),  # a debug run must not prevent deleting a module
            )
            refuse_wrong(problems)
            end_wait(self.robot)
            await self._runner.start(kept, uses)

    async def run(self, id: str, mode: str = "", condition: str = "") -> None:
        """Run a saved task at its time; ``mode`` and ``condition``, if given, replace the stored ones."""
        async with self._turns.take():
            state = await self._check_table(TaskOperation.RUN, id)
            task = await self._store.get(id)
            assert task is not None, "the table refuses to run what does not exist"
            task = replace(task, mode=mode or task.mode, condition=condition or task.condition, owner=identity())
            due = self._timetable.due(task)
            if state is TaskState.RUN:  # no second instance; changes apply to the next run
                await self._store.put(task)
                self._timetable.drop(id)
                if task.mode == "cycle":
                    self._timetable.wait(task)
                return
            if due is None and task.condition.strip() != "@reboot":
                raise NotAllowed(f"the time of {task.condition!r} is past or never comes")
            now = due is not None and due <= self.robot.clock.epoch()
            uses = await self._store.uses(id)
            if now:
                await self._runner.check_startable(uses)
            task = replace(task, state=TaskState.RUN_WAIT, due=due)
            await self._store.put(task)
            end_wait(self.robot)
            if now:
                await self._runner.start(task, uses)
            elif due is not None:
                self._timetable.set(id, due)

    async def refusal(self, operation: TaskOperation, id: str) -> ProgramError | None:
        """Return the error that ``operation`` would raise now, or None."""
        if id in self._turns.lost:
            await self._turns.restore()
        try:
            await self._check_table(operation, id)
        except ProgramError as refusal:
            return refusal
        return None

    async def suspend(self, id: str) -> None:
        """Suspend the program and the motion that it started."""
        async with self._turns.take():
            await self._check_table(TaskOperation.SUSPEND, id)
            await self._runner.suspend(self._runs[id])

    async def recover(self, id: str) -> None:
        """Continue the program and its motion."""
        async with self._turns.take():
            await self._check_table(TaskOperation.RECOVER, id)
            await self._runner.recover(self._runs[id])

    async def stop_at(self, id: str, stops: Stops) -> None:
        """Set the places where a task halts, in place of earlier ones; not stored beyond the server's life.

        Applies at once to a watched run, otherwise from the next start. Raises ProgramError.
        """
        async with self._turns.take():
            run = self._runs.get(id)
            if run is None and id != DEBUG and await self._store.get(id) is None:
                raise NotAllowed(f"there is no task {id}")
            if run is not None:
                run.check_watched()
                try:
                    run.stop_at(stops)
                except LookupError as error:
                    raise NotAllowed(str(error)) from None
            self._runner.stops.pop(id, None)
            if stops != Stops():
                self._runner.stops[id] = stops

    async def step(self, id: str, step: Step = Step.INTO, *, to_block: bool = False) -> None:
        """Run a task by one step, to a statement or a block, and suspend it there. Raises ProgramError."""
        async with self._turns.take():
            await self._check_table(TaskOperation.RECOVER, id)
            run = self._runs.get(id)
            if run is None:
                raise NotAllowed(f"the task {id} does not run")
            run.check_watched()
            if run.state is TaskState.SUSPEND:
                await self._runner.recover(run, lambda: run.step(step, to_block=to_block))
            else:
                run.step(step, to_block=to_block)

    async def shutdown(self, ids: Collection[str], why: str = "") -> dict[str, ProgramError]:
        """End programs and cancel their motions, all before waiting for any; return refusals by id.

        ``why`` is the last line of their logs; by default the user ended them.
        """
        refused: dict[str, ProgramError] = {}
        _expect_end(self._runs, ids)
        async with self._turns.take():
            states: dict[str, TaskState] = {}
            for id in ids:
                try:
                    states[id] = await self._check_table(TaskOperation.SHUTDOWN, id)
                except ProgramError as refusal:
                    refused[id] = refusal
                    _expect_end(self._runs, [id], ends=False)
            self._late.give_reason(refused, why)
            for id in states:
                if id in self._runs:
                    self._runs[id].call_off()
            for id, before in states.items():
                self.reports.publish(done(TaskOperation.SHUTDOWN, id, await self._shut_down(id, before, why)))
        return refused

    async def _shut_down(self, id: str, before: TaskState, why: str) -> TaskState:
        if id in self._runs:
            return await self._runner.end(id, why=why or "ended by the user")
        task = await self._store.get(id)
        state = state_after(before, TaskOperation.SHUTDOWN, task.mode if task else "")
        await self._store.set_state(id, state)
        self._timetable.drop(id)
        return state

    async def delete(self, id: str) -> None:
        """Delete a task and its log; do nothing if it does not exist."""
        async with self._turns.take():
            await self._check_table(TaskOperation.DELETE, id)
            await self._store.remove(id)
            self._runner.stops.pop(id, None)
            self._runner.newest.pop(id, None)

    async def end_of(self, owner: str, why: str) -> None:
        """End all runs of ``owner``."""
        for id in [id for id, run in self._runs.items() if run.task.owner == owner]:
            async with self._turns.take():
                if id in self._runs:
                    await self._runner.end(id, why=why)

    async def _check_table(self, operation: TaskOperation, id: str) -> TaskState:
        """Return the task's current state if the tables allow ``operation``. Raises NotAllowed."""
        if (run := self._runs.get(id)) is not None:
            state = run.state
        else:
            task = await self._store.get(id)
            state = TaskState(task.state) if task else TaskState.NULL
            if state.alive and id not in self._turns.lost:  # its end could not be recorded
                state = TaskState.SHUTDOWN
        self._late.check_mode(operation, id, possible=next_state(state, operation) is not None)
        if next_state(state, operation) is None:
            words = f"The current operation({operation}) is illegal: {id} is in {state}."
            if state is TaskState.SUSPEND:
                words += " Recover it to go on, or shut it down first."
            elif state is TaskState.RUN_WAIT:
                words += " It waits for its time: shut it down first."
            elif state is TaskState.RUN:
                words += " It is running: shut it down first."
            raise NotAllowed(words)
        return state

    async def _keep(
        self, task: StoredProgram, operation: TaskOperation, *, correct: bool, uses: Collection[str]
    ) -> StoredProgram:
        state = await self._check_table(operation, task.id)
        if state is TaskState.NULL and await self._store.count() >= TASKS_MAX:
            raise LimitReached(f"{TASKS_MAX} tasks are stored already")
        kept = replace(task, state=state_after(state, operation, task.mode, correct=correct))
        await self._store.put(kept, uses)
        return kept

    async def _fire(self, id: str) -> None:
        """Start a task at its scheduled time."""
        async with self._turns.take():
            task = await self._store.get(id)
            if task is None or self._turns.closed:
                return
            if task.mode == "cycle":
                self._timetable.wait(task)
            if (run := self._runs.get(id)) is not None:
                run.log.write("note", f"its time came again while it was in {run.state}: not started a second time")
                return
            if task.state != TaskState.RUN_WAIT:
                return
            try:
                check_scheduled(self.robot)
                act_for_owner(self.robot, task)
                uses = await self._store.uses(id)
                await self._runner.check_startable(uses)
                await self._runner.start(task, uses)
            except ProgramError as refusal:
                state = TaskState.RUN_WAIT if task.mode == "cycle" else TaskState.SHUTDOWN
                note = LogEntry(self.robot.clock.epoch(), "error", f"not started at its time: {refusal}")
                await self._store.set_state(id, state, [note])
                self.reports.publish(TaskReport(id, TaskOperation.START, str(refusal), refusal))


def _shut_down(run: TaskRun) -> str:
    """Return the note in the log of a task that an orderly end of the server ends."""
    if run.state is TaskState.SUSPEND:
        why = "the server shut down while the task was suspended; the task was ended"
    else:
        why = "the server shut down while the task was under way; the task was ended"
    return why


def _expect_end(runs: Mapping[str, TaskRun], ids: Collection[str], *, ends: bool = True) -> None:
    """Note that runs are about to end, so that calls interrupted until then are not reported as the robot's faults."""
    for id in ids:
        if id in runs:
            runs[id].is_ending = ends
