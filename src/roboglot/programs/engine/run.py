"""The server's end of one run of a program: its events, its limits, and the control of its process.

Every frame of the worker is hostile: lengths, rates and counts are checked, and the first breach ends the run. Calls
are in ``calls.py``, places in ``position.py``. Knows no robot. Times are in the machine's time, as they measure load.
"""

from __future__ import annotations

import asyncio
import signal
import time
from collections.abc import Callable, Iterable

from roboglot.programs.engine.calls import CallRate, Calls
from roboglot.programs.engine.event_queue import EventQueue
from roboglot.programs.engine.events import Answer, Event, ExitReason, Failed, Finished, Limits
from roboglot.programs.engine.launcher import Worker
from roboglot.programs.engine.messages import (
    NAME_MAX,
    SHORT,
    CallMessage,
    FailedMessage,
    FinishedMessage,
    Message,
    OutputMessage,
    PlainCall,
    ProtocolViolation,
    VariablesMessage,
    decode,
)
from roboglot.programs.engine.position import Position
from roboglot.programs.engine.post_mortem import reason_of
from roboglot.programs.engine.share import ThreadShare
from roboglot.programs.engine.shared_page import Page
from roboglot.programs.engine.stopwatch import Stopwatch
from roboglot.programs.engine.worker_socket import Wire
from roboglot.programs.library.program import Program
from roboglot.programs.worker.frames import ERROR_MAX

SHORT_COST = 30e-6
"""Seconds of the server's thread charged for a short frame and its handling: 20 to 33 us were measured."""
OUTPUT_COST = 15e-6
"""Seconds of the server's thread charged for a short piece of output."""


class Run:
    """A started program. Iterate over it for its events (one reader); the last one is Finished or Failed.

    ``calls`` answers the program, ``position`` is its place. Read the run to its end or call ``kill``; otherwise its
    process stays alive.
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
        share: ThreadShare | None = None,
    ) -> None:
        self._limits = limits
        self._inbox = EventQueue()
        self._worker: Worker | None = None
        self._ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._ending: Finished | Failed | None = None
        self.over = False
        """True once the run has ended or is being ended."""
        self._clock = Stopwatch(limits.wall, self._over_time)
        self._printed = 0
        self._switch = asyncio.Lock()
        self.account = (share or ThreadShare()).account()
        """The program's use of the server's thread; all work done for it is charged here."""
        self.wire = Wire(self, self.account)
        """The server's end of the worker's socket."""
        self.position = Position(program, page, watched=watched)
        rate = CallRate(limits.call_rate)
        self.calls = Calls(self, callable_names, rate, self.position, self.account, history)
        self.noticed: Callable[[dict[str, str]], None] | None = None
        """Called with the values of a watched program's variables, as text, at halts and calls."""
        self.write = self.wire.write
        self.put = self._inbox.put

    def __aiter__(self) -> Run:
        return self

    async def __anext__(self) -> Event:
        event = await self._inbox.take()
        if event is None:
            raise StopAsyncIteration
        if self.wire.paused:
            self.wire.read_on()
        return event

    @property
    def pid(self) -> int:
        """The worker's process id."""
        return self._worker.pid if self._worker else 0

    @property
    def suspended(self) -> bool:
        """True while the process is stopped."""
        return self._worker is not None and self._worker.stopped and not self._worker.died.done()

    @property
    def exit_reason(self) -> ExitReason | None:
        """Reason for the end of the run; None before that."""
        match self._ending:
            case Finished():
                return ExitReason.FINISHED
            case Failed(reason=reason):
                return reason
        return None

    async def suspend(self) -> None:
        """Stop the process at once; return when the kernel has confirmed. Replies sent meanwhile wait."""
        async with self._switch:
            if self._worker and not self._worker.stopped and not self._worker.died.done():
                self._worker.signal(signal.SIGSTOP)
                await self._worker.until(stopped=True)
                self._clock.stop()

    async def resume(self) -> None:
        """Continue a suspended program; return when it runs."""
        async with self._switch:
            if self._worker and self._worker.stopped and not self._worker.died.done():
                self._clock.start()
                self._worker.signal(signal.SIGCONT)
                await self._worker.until(stopped=False)

    def end_now(self) -> None:
        """Kill the process and drop its unread events; do nothing after the end."""
        self.end(ExitReason.KILLED, "Killed", "the program was stopped")
        self.wire.drop()
        self._inbox.drop()

    async def kill(self) -> None:
        """End the process at once; return when it is gone."""
        self.end_now()
        await self.wait()

    async def wait(self) -> None:
        """Wait until the process is gone and its last event can be read."""
        await asyncio.shield(self._ended)

    # Used by the engine and the socket.

    def attach(self, worker: Worker) -> None:
        """Attach the process that was forked for this run; kill it if the run is over already."""
        self._worker = worker
        if self._ending is not None:
            worker.signal(signal.SIGKILL)
        self._clock.start()
        worker.died.add_done_callback(lambda _: self.settle())

    def take(self, body: bytes) -> bool:
        """Take one frame of the worker; return False when no more frames matter. Raises ProtocolViolation."""
        if self.over:
            return False
        size = len(body)
        began = time.thread_time() if size > SHORT else 0.0
        message = decode(body)
        if isinstance(message, PlainCall) or isinstance(message, CallMessage):  # noqa: SIM101 - twice as fast
            self.calls.take(message, size)
        else:
            self._take_message(message)
        cost = OUTPUT_COST if isinstance(message, OutputMessage) else SHORT_COST
        self.account.charge(cost + (time.thread_time() - began if began else 0.0))
        return not self.over

    @property
    def awaited(self) -> bool:
        """True while the reader waits for an event, and no further frame has come."""
        reader = self._inbox.reader
        return reader is not None and not reader.done() and not self.wire.frames

    @property
    def full(self) -> bool:
        """True while the reader is too far behind to read more from the worker."""
        return self._inbox.full

    def broken(self, error: Exception) -> None:
        """End the run of a worker that broke the protocol."""
        self.end(ExitReason.PROTOCOL, "ProtocolError", f"the worker broke the protocol: {error}")

    def abort(self, error: ProtocolViolation) -> None:
        """End the run of a worker that broke the protocol, and drop its socket."""
        self.broken(error)
        self.wire.drop()

    def end(self, reason: ExitReason, kind: str, message: str) -> None:
        """End the run by a decision of the host; the first reason counts."""
        source = self.position.source_line
        line = self.position.line if source else 0
        self._finish(Failed(kind, message, line, source, reason, self.position.unit))

    def settle(self) -> None:
        """Emit the last event once the process is dead and the socket has been read to its end."""
        worker = self._worker
        if worker is None or not worker.died.done() or not self.wire.closed or self._ended.done():
            return
        if self._ending is None:
            self.end(*reason_of(worker.died.result(), self._limits.cpu))
        self._clock.stop()
        self.position.close()
        assert self._ending is not None
        self._inbox.put(self._ending)
        self._inbox.close()
        self._ended.set_result(None)

    def _take_message(self, message: Message) -> None:
        match message:
            case OutputMessage(text=text):
                self._take_output(text)
            case VariablesMessage(variables=variables):
                if self.noticed is not None and self.position.watched:
                    self.noticed(variables)
            case FinishedMessage():
                self._finish(Finished())
            case FailedMessage():
                self._take_failure(message)
            case _:
                raise ProtocolViolation("an answer without a request")

    def _take_failure(self, failed: FailedMessage) -> None:
        reason = ExitReason.MEMORY if failed.type == "MemoryError" else ExitReason.ERROR
        unit, source = self.position.source_of(failed.unit, failed.line)
        line = failed.line if source else 0
        self._finish(Failed(failed.type[:NAME_MAX], failed.message[:ERROR_MAX], line, source, reason, unit))

    def _take_output(self, text: str) -> None:
        self._printed += len(text)
        if self._printed > self._limits.output:
            words = f"the program printed more than {self._limits.output} characters"
            self.end(ExitReason.OUTPUT, "OutputLimit", words)
        else:
            self._inbox.write(text)

    def _over_time(self) -> None:
        self.end(ExitReason.WALL, "TimeLimit", f"the program ran for more than {self._limits.wall:g} s")

    def _finish(self, ending: Finished | Failed) -> None:
        if self._ending is None:
            self._ending, self.over = ending, True
            if self._worker:
                self._worker.signal(signal.SIGKILL)  # a worker may report its end and not exit
