"""One run of a program, seen from the server: its events, its limits, and the hand on its process.

Every frame of the worker is hostile: lengths, rates and counts are checked here, and the first that breaks a rule
ends the run. Knows no robot: a call is a name with values. Time here is the machine's: it measures load, not the robot.
"""

from __future__ import annotations

import asyncio
import signal
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable
from functools import partial
from typing import Any

import msgspec

from roboglot.programs.engine.event_queue import Inbox
from roboglot.programs.engine.events import (
    Answer,
    Call,
    Event,
    ExitReason,
    Failed,
    Finished,
    Halted,
    Limits,
    Replayed,
)
from roboglot.programs.engine.launcher import Worker
from roboglot.programs.engine.messages import (
    NAME_MAX,
    CallMessage,
    FailedMessage,
    FinishedMessage,
    Message,
    OutputMessage,
    ProtocolViolation,
    decode,
)
from roboglot.programs.engine.share import STEP, Share
from roboglot.programs.engine.shared_page import Page
from roboglot.programs.engine.stopwatch import Stopwatch
from roboglot.programs.engine.worker_socket import Wire
from roboglot.programs.library.program import Program
from roboglot.programs.worker.child import MESSAGE_MAX
from roboglot.programs.worker.frames import frame
from roboglot.programs.worker.link import EXIT_MEMORY, HALT, REPLY_MAX
from roboglot.programs.worker.values import drained, pack

_BURST = 0.1
"""Seconds worth of calls that may come at once before the call rate is held."""
CALL_BYTES_RATE_MAX = 2 * 1024 * 1024
"""Bytes of arguments a second."""
SHORT = 256
"""Bytes of a frame that is not timed: two looks at a clock would take as long as it does."""
SHORT_COST = 50e-6
"""Seconds of the server's thread that such a one is taken to cost, with all that goes on around it."""
OUTPUT_COST = 15e-6
"""The same for a piece of output."""
Values = tuple[tuple[Any, ...], dict[str, Any]]
_TOLD_NOTHING = b'{"t":"value","value":null}'  # what most calls are answered


class Run:
    """A started program. Iterate over it for its events (one reader); the last one is Finished or Failed.

    Whoever starts a run reads it to its end or calls ``kill``: until then its process lives.
    """

    def __init__(
        self,
        program: Program,
        callable_names: frozenset[str],
        limits: Limits,
        page: Page,
        history: Iterable[Answer] = (),
        *,
        watched: bool = False,
        share: Share | None = None,
    ) -> None:
        self._program = program
        self._callable = callable_names
        self._limits = limits
        self._page = page
        self.watched = watched
        """Whether it can be stepped through and halt at lines."""
        self.account = (share or Share()).account()
        """What it takes of the server's thread; whoever does something for it charges it."""
        self._loop = asyncio.get_running_loop()
        self._inbox = Inbox()
        self._wire = Wire(self, self.account)
        self._worker: Worker | None = None
        self._over: asyncio.Future[None] = self._loop.create_future()
        self._ending: Finished | Failed | None = None
        self._waiting: Call | Halted | None = None
        self._history = deque(history)
        self._clock = Stopwatch(limits.wall, self._over_time)
        self.answered: Callable[[str, bytes], None] = lambda name, body: None
        """Hears of every answer that is sent, with its call's name: what is needed to let the program go on later."""
        self._printed = 0
        self._paid_until = 0.0
        self._switch = asyncio.Lock()

    def __aiter__(self) -> Run:
        return self

    async def __anext__(self) -> Event:
        event = await self._inbox.take()
        if event is None:
            raise StopAsyncIteration
        if self._wire.paused:
            self._wire.read_on()
        return event

    @property
    def pid(self) -> int:
        """The worker's process id."""
        return self._worker.pid if self._worker else 0

    @property
    def line(self) -> int:
        """The line that is running or waiting now, 0 before the first. It comes from the program's memory.

        A hostile one can lie.
        """
        return self._page.place[1]

    @property
    def unit(self) -> str:
        """The module the line belongs to, "" for the program itself."""
        return self._program.unit_name(self._page.place[0])

    @property
    def suspended(self) -> bool:
        """Whether the process is stopped."""
        return self._worker is not None and self._worker.stopped and not self._worker.died.done()

    @property
    def exit_reason(self) -> ExitReason | None:
        """Why the run is over; None while it isn't."""
        match self._ending:
            case Finished():
                return ExitReason.FINISHED
            case Failed(reason=reason):
                return reason
        return None

    def reply(self, id: int, value: Any = None) -> None:
        """Answer a call with None, bool, int, float, str, Record, or lists and dicts of these.

        TypeError or ValueError for what can't cross (the call still waits), LookupError if no such call waits.
        """
        self._answer(id, _TOLD_NOTHING if value is None else msgspec.json.encode({"t": "value", "value": pack(value)}))

    def fail(self, id: int, type: str, message: str) -> None:
        """Answer a call with an error.

        A built-in exception's name, or any other, which becomes a kind of RobotError.
        """
        self._answer(id, msgspec.json.encode({"t": "raise", "type": type, "message": message}))

    def step(self) -> None:
        """Halt before the statement that comes next; what waits or is suspended has to be let go on besides."""
        self._page.stop_next(self.watched)

    def stop_at(self, lines: Iterable[tuple[str, int]]) -> None:
        """Halt before the statements at these lines (of a module, or "") and no others; LookupError for one that isn't
        there. A line without a statement means the next one with one.
        """
        places = [
            (self._program.names.index(unit) if unit in self._program.names else -1, line) for unit, line in lines
        ]
        if wrong := [line for unit, line in places if not self._program.places.number(unit, line)]:
            raise LookupError(f"there is no line {wrong[0]}")
        self._page.clear_stops()
        for place in places if self.watched else ():
            self._page.stop_at(*place)

    async def suspend(self) -> None:
        """Stop the process wherever it is; returns when the kernel has confirmed.

        Replies sent meanwhile wait for it.
        """
        async with self._switch:
            if self._worker and not self._worker.stopped and not self._worker.died.done():
                self._worker.signal(signal.SIGSTOP)
                await self._worker.until(stopped=True)
                self._clock.stop()

    async def resume(self) -> None:
        """Let a suspended program go on; returns when it does."""
        async with self._switch:
            if self._worker and self._worker.stopped and not self._worker.died.done():
                self._clock.start()
                self._worker.signal(signal.SIGCONT)
                await self._worker.until(stopped=False)

    def end_now(self) -> None:
        """Have the process killed; nothing of it is read any more. Does nothing after the end."""
        self.end(ExitReason.KILLED, "Killed", "the program was stopped")
        self._wire.drop()
        self._inbox.drop()

    async def kill(self) -> None:
        """End the process at once; returns when it is gone."""
        self.end_now()
        await self.wait()

    async def wait(self) -> None:
        """Until the process is gone and its last event can be read."""
        await asyncio.shield(self._over)

    # For the engine and the wire.

    @property
    def wire(self) -> Wire:
        """The loop's end of the socket."""
        return self._wire

    def attach(self, worker: Worker) -> None:
        """Take the process that was forked for this run. On a busy machine the run may be over by then."""
        self._worker = worker
        if self._ending is not None:
            worker.signal(signal.SIGKILL)
        self._clock.start()
        worker.died.add_done_callback(lambda died: self.settle())

    def take(self, body: bytes) -> bool:
        """One frame of the worker; False when no more frames matter. Raises ProtocolViolation."""
        if self._ending is not None:
            return False
        began = time.thread_time() if len(body) > SHORT else 0.0
        self._take_message(message := decode(body), len(body))
        cost = OUTPUT_COST if isinstance(message, OutputMessage) else SHORT_COST
        self.account.charge(cost + (time.thread_time() - began if began else 0.0))
        return self._ending is None

    @property
    def full(self) -> bool:
        """Whether the reader is too far behind to read more from the worker."""
        return self._inbox.full

    def _take_message(self, told: Message, size: int) -> None:
        match told:
            case CallMessage() as call:
                self._take_call(call, size)
            case OutputMessage(text=text):
                self._take_output(text)
            case FinishedMessage():
                self._finish(Finished())
            case FailedMessage(type=kind, message=message, unit=unit, line=line):
                reason = ExitReason.MEMORY if kind == "MemoryError" else ExitReason.ERROR
                source = self._program.source_line(unit, line)
                name = self._program.unit_name(unit)
                self._finish(
                    Failed(kind[:NAME_MAX], message[:MESSAGE_MAX], line if source else 0, source, reason, name)
                )
            case _:
                raise ProtocolViolation("an answer nobody asked for")

    def broken(self, error: Exception) -> None:
        """The worker broke the protocol: the run is over."""
        self.end(ExitReason.PROTOCOL, "ProtocolError", f"the worker broke the protocol: {error}")

    def end(self, reason: ExitReason, kind: str, message: str) -> None:
        """End the run for a reason of the host's; the first reason counts."""
        unit, line = self._page.place
        source = self._program.source_line(unit, line)
        self._finish(Failed(kind, message, line if source else 0, source, reason, self._program.unit_name(unit)))

    def settle(self) -> None:
        """Once the process is dead and the socket read to its end: the last event."""
        worker = self._worker
        if worker is None or not worker.died.done() or not self._wire.closed or self._over.done():
            return
        if self._ending is None:
            self.end(*self._autopsy(worker))
        self._clock.stop()
        self._page.close()
        assert self._ending is not None
        self._inbox.put(self._ending)
        self._inbox.close()
        self._over.set_result(None)

    def _take_output(self, text: str) -> None:
        self._printed += len(text)
        if self._printed > self._limits.output:
            words = f"the program printed more than {self._limits.output} characters"
            self.end(ExitReason.OUTPUT, "OutputLimit", words)
        else:
            self._inbox.write(text)

    def _take_call(self, call: CallMessage, size: int) -> None:
        if self._waiting is not None:
            raise ProtocolViolation("a call before the reply to the last one")
        if call.name == HALT and self.watched:
            self._halt(call)
            return
        if call.name not in self._callable:
            raise ProtocolViolation(f"a call of '{call.name[:NAME_MAX]}', which was not offered")
        self._waiting = Call(call.id, call.name, (), {}, 0)  # its values are still to be read
        values = call.values()
        if size <= SHORT:
            self._called(call, size, drained(values))
        else:
            self._read(call, size, values)

    def _read(self, call: CallMessage, size: int, values: Generator[None, None, Values]) -> None:
        """Read the values of a long call, with turns for others in between."""
        if self._ending is not None:
            return
        began, until = time.thread_time(), time.perf_counter() + STEP
        try:
            while time.perf_counter() < until:
                next(values)
        except StopIteration as done:
            self._called(call, size, done.value)
        except ProtocolViolation as error:
            self.broken(error)
            self._wire.drop()
        else:
            self.account.charge(time.thread_time() - began)
            self.account.queue(partial(self._read, call, size, values))

    def _called(self, call: CallMessage, size: int, values: Values) -> None:
        """Hand the call to the reader, when its time has come."""
        args, kwargs = values
        interrupted = bool(self._history) and self._history[0].body is None
        if self._history and not self._replay(call, args, kwargs):
            return
        unit, line = self._page.place
        name = self._program.unit_name(unit)
        self._waiting = event = Call(call.id, call.name, args, kwargs, line, name, interrupted)
        delay, deliver = self._delay(size), partial(self._deliver, event)
        if delay > 0:
            self._loop.call_later(delay, self.account.go_on, deliver)
        else:
            self.account.go_on(deliver)

    def _halt(self, call: CallMessage) -> None:
        """It halts; what is only done again does not."""
        unit, line = self._page.place
        self._waiting = halted = Halted(call.id, line, self._program.unit_name(unit))
        if self._history:
            self.reply(call.id)
            return
        self._page.stop_next(False)
        self._loop.call_later(max(0.0, self._delay()), self._deliver, halted)

    def _replay(self, call: CallMessage, args: tuple[Any, ...], kwargs: dict[str, Any]) -> bool:
        """Answer it as in the earlier life; True if it was cut off there, and is still to be answered."""
        known = self._history.popleft()
        if known.name != call.name:
            words = f"the program asked for {call.name} where it had asked for {known.name} before"
            self.end(ExitReason.DIVERGED, "ReplayDiverged", words)
        elif known.body is None:
            return True
        else:
            self._waiting = None
            self._inbox.put(Replayed(call.name, args, kwargs, known.body))
            self._wire.write(frame(known.body))
        return False

    def _over_time(self) -> None:
        self.end(ExitReason.WALL, "TimeLimit", f"the program ran for more than {self._limits.wall:g} s")

    def _delay(self, size: int = 0) -> float:
        """Seconds by which this call is early, given the call rate and its bytes."""
        now = self._loop.time()
        cost = max(1 / self._limits.call_rate, size / CALL_BYTES_RATE_MAX)
        self._paid_until = max(self._paid_until, now - _BURST) + cost
        return self._paid_until - now

    def _deliver(self, call: Call | Halted) -> None:
        if self._ending is None:
            self._inbox.put(call)

    def _answer(self, id: int, body: bytes) -> None:
        if len(body) > REPLY_MAX:
            raise ValueError("the value is too large for a program")
        if self._ending is not None:
            return
        if self._waiting is None or self._waiting.id != id:
            raise LookupError(f"no call {id} is waiting")
        waited, self._waiting = self._waiting, None
        if isinstance(waited, Call):
            self.answered(waited.name, body)
        self._wire.write(frame(body))

    def _finish(self, ending: Finished | Failed) -> None:
        if self._ending is None:
            self._ending = ending
            if self._worker:
                self._worker.signal(signal.SIGKILL)  # also when it says it has finished: it could stay

    def _autopsy(self, worker: Worker) -> tuple[ExitReason, str, str]:
        """Why a process ended that did not say so itself."""
        death = worker.died.result()
        if death.status is None:
            return ExitReason.LOST, "EngineLost", "the program engine has ended"
        # The kernel's limit counts whole ticks, the accounting does not: on a busy machine they differ by some tenths.
        if death.status == -signal.SIGXCPU or (death.status == -signal.SIGKILL and death.cpu >= self._limits.cpu * 0.5):
            return ExitReason.CPU, "CpuLimit", f"the program used more than {self._limits.cpu} s of processor time"
        if death.status == EXIT_MEMORY:
            return ExitReason.MEMORY, "MemoryError", "the program used more memory than it may"
        how = f"signal {-death.status}" if death.status < 0 else f"exit code {death.status}"
        return ExitReason.CRASHED, "Crashed", f"the program's process ended unexpectedly ({how})"
