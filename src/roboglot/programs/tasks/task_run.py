"""One running task: the engine's run, the session of its calls, its blocks and its log.

Knows no table of states and no task store: the runner that started it stores its states.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable
from contextvars import Context, copy_context
from dataclasses import replace
from functools import partial

from roboglot.model.client_context import set_client
from roboglot.model.errors import RobotError
from roboglot.model.inputs.metering import metered
from roboglot.model.robot import Robot
from roboglot.programs.engine.events import Call, ExitReason, Failed, Finished, Halted, Output, Replayed, Stops
from roboglot.programs.engine.journal import Journal
from roboglot.programs.engine.run import Run
from roboglot.programs.engine.usage import usage_of
from roboglot.programs.errors import NotAllowed
from roboglot.programs.functions.interrupted import call_cut_off
from roboglot.programs.functions.results import SHORT_MAX, in_short, refusal
from roboglot.programs.functions.session import Session, TaskEnded
from roboglot.programs.functions.table import call as call_function
from roboglot.programs.language.places import Step
from roboglot.programs.library.modules import HEADER_LINES
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks.block_stops import MARKS, BlockStops
from roboglot.programs.tasks.call_time import CallTime
from roboglot.programs.tasks.control import ControlWatch
from roboglot.programs.tasks.process_time import ProcessTime
from roboglot.programs.tasks.replay import Replay
from roboglot.programs.tasks.reports import (
    Insight,
    Listeners,
    LogListener,
    NewestRun,
    Pace,
    Reading,
    Report,
    RunFigures,
    Variables,
    done,
)
from roboglot.programs.tasks.run_host import RunHost
from roboglot.programs.tasks.run_log import RunLog
from roboglot.programs.tasks.states import TaskOperation, TaskState
from roboglot.transport.eager import begin
from roboglot.values import dataclass

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Outcome:
    """End of a run; ``error`` is empty if the program finished or ended itself."""

    reason: ExitReason
    error: str = ""


@dataclass(frozen=True, slots=True)
class RunListeners:
    """Listeners to a run: to its state and blocks, to each log entry, and to halts at a breakpoint.

    The program waits for ``pace`` after each block, for ``log_pace`` after each line of its log.
    """

    report: Report
    logged: LogListener
    at_breakpoint: Callable[[], Awaitable[None]]
    insights: Listeners[[Insight]]
    pace: Pace
    log_pace: Pace


class TaskRun:
    """A started program. ``execute`` once; ``suspend``, ``resume`` and ``kill`` at any time meanwhile."""

    def __init__(
        self,
        task: StoredProgram,
        run: Run,
        robot: Robot,
        *,
        listeners: RunListeners,
        journal: Journal,
        replaying: int = 0,
        stops: Stops | None = None,
    ) -> None:
        self.task = task
        self.state = TaskState.RUN_WAIT
        self._run = run
        self.log = RunLog(robot.clock, run, listeners.log_pace, lambda entry: listeners.logged(task.id, entry))
        self.host = RunHost(task.id, self.log, listeners.report, self._ask_to_halt)
        self._at_breakpoint = listeners.at_breakpoint
        self._halts = False  # after the pending answer
        self._session = self.host.session = Session(robot, task.id, self.host)
        self._clock = robot.clock
        self._began = robot.clock.time()
        self._report = listeners.report
        self._pace = listeners.pace
        self._answering: asyncio.Task[None] | None = None
        self._ended_itself = self._called_off = False
        self.is_ending = False  # whether its end has been requested, and waits for its turn
        self._journal = journal
        run.calls.answered = journal.answered
        self._replay = Replay(self._session, self.host, replaying)
        self._block_stops = BlockStops(run.position, stops)
        self._insights = listeners.insights
        self.started = 0.0 if replaying else robot.clock.epoch()  # this run's log begins here
        self.lasting = NewestRun(self.started)
        self.variables: dict[str, str] = {}

        def notice(held: dict[str, str]) -> None:
            self.variables = held
            listeners.insights.publish(Variables(task.id, held))

        run.noticed = notice
        self.control = ControlWatch(robot, f"visual {task.id}", lambda text: self.log.write("error", text))
        self.time = ProcessTime(robot.clock)
        self._call_time = CallTime(robot.clock, self._session.sleep)

    @property
    def line(self) -> int:
        """Current line, in the text of ``module`` or, if that is empty, in the program's own text."""
        return self._run.position.line - HEADER_LINES if self._run.position.unit else self._run.position.line

    @property
    def module(self) -> str:
        """Module of the current line, "" for the program's own text."""
        return self._run.position.unit

    @property
    def watched(self) -> bool:
        """True if the program can be stepped through and halts at lines."""
        return self._run.position.watched

    def figures(self) -> RunFigures:
        """Return the run's current use of resources."""
        usage = usage_of(self._run.pid)
        return RunFigures(self.task.id, self.state, usage.cpu, usage.memory, self._clock.time() - self._began)

    def check_watched(self) -> None:
        """Raise ProgramError if the program cannot be stepped through."""
        if not self.watched:
            words = f"{self.task.id} runs at full speed: set breakpoints before it starts, or debug it"
            raise NotAllowed(words)

    @property
    def block(self) -> str:
        """Id of the open block, "" for none."""
        return self.host.block

    async def execute(self) -> Outcome:
        """Answer the program's calls until it ends, then cancel the actions that it started."""
        outcome = Outcome(ExitReason.LOST, "the program was lost")
        set_client(f"visual {self.task.id}", identity=self.task.owner)
        self._run.calls.asked = partial(self._on_call, copy_context())
        self.control.start()
        self.time.begin()
        try:
            async for event in self._run:
                match event:
                    case Output(text=text):
                        await self.log.print(text)
                    case Replayed():
                        await self._replay.follow(event)
                        await self._followed()
                    case Call():
                        if event.interrupted:
                            await self._followed()
                        self._on_call(copy_context(), event)
                    case Halted():
                        self._answering = asyncio.create_task(self._halt(event), name=f"halt {self.task.id}")
                    case Finished():
                        outcome = Outcome(ExitReason.FINISHED)
                    case Failed():
                        outcome = Outcome(event.reason, _in_words(event))
        finally:
            if self._answering is not None:
                self._answering.cancel()
            self.control.close()
            self.log.close()
            self._session.cancel("the program has ended")
            await self._run.kill()
        return Outcome(ExitReason.FINISHED) if self._ended_itself else outcome

    async def revive(self) -> None:
        """Replay the program's calls instead of a start, and suspend it where it was interrupted."""
        self.state = TaskState.SUSPEND
        self._session.pause()
        self._run.calls.keeps_last = True
        if not self._replay.left:
            await self._hold()

    async def close_journal(self) -> None:
        """Delete the journal of a run whose end is stored."""
        await self._journal.close()

    async def suspend(self) -> None:
        """Stop the process at once, then pause its actions on the robot."""
        await self._run.suspend()
        self.time.stop(True)
        self._session.pause()

    async def resume(self) -> None:
        """Continue the actions and the process."""
        self._session.resume()
        self.time.stop(False)
        await self._run.resume()
        self._run.calls.go_on()

    def step(self, step: Step = Step.INTO, *, to_block: bool = False) -> None:
        """Halt after a step: before a statement, or at the beginning of a block."""
        (self._block_stops if to_block else self._run.position).step(step)

    def stop_at(self, stops: Stops) -> None:
        """Replace the breakpoints; lines need a watched program. Raises LookupError for a line that does not exist."""
        self._run.position.stop_at(in_units(stops).lines)
        self._block_stops.set(stops)
        if stops.first:
            self.step()

    def call_off(self) -> None:
        """Cancel the program's actions and start ending the process; ``kill`` also waits for its end."""
        self._called_off = True
        self._session.cancel("the program was ended")
        self._run.end_now()
        self.log.hurry()

    async def kill(self) -> None:
        """Cancel the program's actions, end the process and wait for its end."""
        self.call_off()
        await self._run.wait()
        self.log.close()

    async def _followed(self) -> None:
        """Count a replayed call; after the last one, hold the program where it was interrupted."""
        self._replay.left -= 1
        if not self._replay.left and self.state is TaskState.SUSPEND:
            await self._hold()

    async def _hold(self) -> None:
        """Suspend the program where it was interrupted, and report it to front ends that connected earlier."""
        self.time.stop(True)
        await self._run.suspend()
        self._report(done(TaskOperation.SUSPEND, self.task.id, TaskState.SUSPEND))

    async def _ask_to_halt(self) -> None:
        self._halts = True

    async def _report_halt(self) -> None:
        """Suspend the task once the journal is written, so that a crash leaves it here, too."""
        self._halts = False
        try:
            await self._journal.written()
            await self._at_breakpoint()
        except Exception:
            log.exception("cannot halt task %s", self.task.id)
        if self.state is not TaskState.SUSPEND:
            await self._run.resume()

    async def _halt(self, halted: Halted) -> None:
        self.time.ask(True)
        if not self._block_stops.passes():
            await self._report_halt()
        self._run.calls.reply(halted.id)
        self.time.ask(False)

    def _on_call(self, context: Context, request: Call) -> None:
        """Answer a call at once, or in a task if that has to wait; charge the time that it takes."""

        async def answer() -> None:
            self.time.ask(True)
            try:
                await metered(self._answer(request), self._run.account.charge)
            finally:
                self.time.ask(False)

        with contextlib.suppress(asyncio.CancelledError):  # as in a task
            self._answering = begin(answer(), f"call {request.name}", context.copy())

    async def _value(self, request: Call) -> object:
        """Make the call; return its value once the program may continue."""
        await self._session.unpaused()
        if request.interrupted:
            value = await call_cut_off(self._session, request.name, request.args, request.kwargs)
        else:
            await self._call_time.begin()
            with self._clock.holding():
                await self._journal.begin(request.name)
            value = await call_function(self._session, request.name, request.args, request.kwargs)
        await self.log.pace.wait()
        if request.name in MARKS:
            await self._pace.wait()
            self._halts |= self._block_stops.halts(self.block)
        elif (
            value is not None
            and not (self._called_off or self.is_ending)
            and (  # an interrupted call is not the robot's fault
                (why := refusal(value)[:SHORT_MAX]) or self._insights.listening
            )
        ):
            place = self.line, self.module, self.block
            reading = Reading(self.task.id, *place, request.name, in_short(value), why)
            self.lasting.note(reading)
            self._insights.publish(reading)
        if request.name == "time.monotonic" and isinstance(value, float):
            value += self._replay.ahead
        return value

    async def _answer(self, request: Call) -> None:
        try:
            value = await self._value(request)
            if self._halts:  # before the reply: it must not let the program run on
                with self._clock.holding():
                    await self._run.suspend()
            self._run.calls.reply(request.id, value)
        except TaskEnded:
            self._ended_itself = True
            await self._run.kill()
        except (RobotError, TypeError, ValueError, ArithmeticError, NotImplementedError) as error:
            self._run.calls.fail(request.id, type(error).__name__, str(error))
        except Exception as error:
            log.exception("%s of task %s crashed", request.name, self.task.id)
            self._run.calls.fail(request.id, "RuntimeError", f"{request.name} broke: {error}")
        else:
            if self._halts:
                await self._report_halt()


def in_units(stops: Stops) -> Stops:
    """Return ``stops`` with the engine's line numbers: a module's text has a header before it."""
    lines = {(module, line + HEADER_LINES if module else line) for module, line in stops.lines}
    return replace(stops, lines=frozenset(lines))


def _in_words(failure: Failed) -> str:
    """Return the error and its place, worded for people."""
    where = f"module {failure.unit}, line {failure.line - HEADER_LINES}" if failure.unit else f"line {failure.line}"
    place = f" ({where}: {failure.source_line})" if failure.line else ""
    return f"{failure.type}: {failure.message}{place}"
