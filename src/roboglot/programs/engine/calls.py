"""The calls of one run: one at a time, no faster than its limits, answered by the host or from an interrupted run.

Every value of the worker is hostile. Knows no process; times are in the machine's time.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from functools import partial
from typing import Protocol

import msgspec

from roboglot.programs.engine.events import Answer, Call, ExitReason, Halted, Replayed
from roboglot.programs.engine.messages import NAME_MAX, SHORT, CallMessage, PlainCall, ProtocolViolation
from roboglot.programs.engine.position import Position
from roboglot.programs.engine.share import STEP, Account
from roboglot.programs.worker.frames import HEADER, frame
from roboglot.programs.worker.link import HALT, NOTHING, REPLY_MAX
from roboglot.programs.worker.values import drained, pack

BURST = 0.1
"""Burst that the call rate allows, in seconds of calls."""
CALL_BYTES_RATE_MAX = 2 * 1024 * 1024
"""Bytes of arguments a second."""
NONE_REPLY = NOTHING[HEADER:]
Values = tuple[tuple[object, ...], Mapping[str, object]]


class CallHost(Protocol):
    """The run that the calls belong to."""

    @property
    def over(self) -> bool:
        """True once the run has ended or is being ended."""

    def write(self, data: bytes) -> None:
        """Send a frame to the worker."""

    @property
    def awaited(self) -> bool:
        """True while the reader waits for an event, and no further frame has come."""

    def put(self, event: Call | Halted | Replayed) -> None:
        """Hand an event to the reader."""

    def end(self, reason: ExitReason, kind: str, message: str) -> None:
        """End the run by a decision of the host."""

    def abort(self, error: ProtocolViolation) -> None:
        """End the run of a worker that broke the protocol, and drop its socket."""


class CallRate:
    """Computes by how much each call must be delayed to keep the rates of calls and bytes."""

    __slots__ = ("_call_cost", "_loop", "_paid_until")

    def __init__(self, calls_per_second: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._call_cost = 1 / calls_per_second
        self._paid_until = 0.0

    def delay(self, size: int = 0) -> float:
        """Count a call of ``size`` bytes; return its delay in seconds, 0 or less for none."""
        now, cost, bytes_cost = self._loop.time(), self._call_cost, size / CALL_BYTES_RATE_MAX
        paid, least = self._paid_until, now - BURST
        self._paid_until = (paid if paid > least else least) + (cost if cost > bytes_cost else bytes_cost)
        return self._paid_until - now


class Calls:
    """Takes calls of the worker and sends the answers. ``names`` may be called; ``history`` holds recorded answers."""

    def __init__(
        self,
        host: CallHost,
        names: frozenset[str],
        rate: CallRate,
        position: Position,
        account: Account,
        history: Iterable[Answer],
    ) -> None:
        self._host = host
        self._names = names
        self._rate = rate
        self._position = position
        self._account = account
        self._history = deque(history)
        self._loop = asyncio.get_running_loop()
        self._waiting: Call | Halted | None = None
        self.asked: Callable[[Call], None] | None = None
        """Called at once with a short call, without its line, while the reader waits; otherwise the reader gets it."""
        self.answered: Callable[[str, bytes], None] | None = None
        """Called with the call's name and each answer sent, to continue the program after a crash."""
        self.keeps_last = False
        """Keep the last answer of ``history`` back until ``go_on``, so that the program waits at its earlier end."""
        self._kept = b""

    def reply(self, id: int, value: object = None) -> None:
        """Answer a call with None, bool, int, float, str, Record, or lists and dicts of these.

        Raises TypeError or ValueError for values that cannot be sent (the call still waits), LookupError if no such
        call waits.
        """
        if value is None:
            self._answer(id, NONE_REPLY, NOTHING)
        else:
            self._answer(id, msgspec.json.encode({"t": "value", "value": pack(value)}))

    def fail(self, id: int, type: str, message: str) -> None:
        """Answer a call with an error: the name of a built-in exception, or another, made a subclass of RobotError."""
        self._answer(id, msgspec.json.encode({"t": "raise", "type": type, "message": message}))

    def go_on(self) -> None:
        """Send the answer that was kept back, if any, and keep none back from now on."""
        self.keeps_last = False  # the program may read that answer later
        kept, self._kept = self._kept, b""
        if kept and not self._host.over:
            self._host.write(kept)

    def take(self, call: CallMessage | PlainCall, size: int) -> None:
        """Take a call of ``size`` bytes. Raises ProtocolViolation.

        A short call goes to ``asked`` at once, if nothing delays it: no earlier answers to repeat, no limit reached.
        """
        if self._waiting is not None:
            raise ProtocolViolation("a call before the reply to the last one")
        name = call.name
        if name not in self._names:
            if name != HALT or not self._position.watched:
                raise ProtocolViolation(f"a call of '{name[:NAME_MAX]}', which was not offered")
            self._halt(call.id)
        elif isinstance(call, PlainCall):
            asked, delay = self.asked, None
            if (
                asked is not None
                and not self._history
                and self._host.awaited
                and not self._account.spent
                and (delay := self._rate.delay(size)) <= 0
            ):
                self._waiting = event = Call(call.id, name, call.args, call.kwargs, 0)
                asked(event)
            else:
                self._deliver(call, size, call.args, call.kwargs, delay)
        else:
            self._waiting = Call(call.id, name, (), {}, 0)  # its values have not been read yet
            if size <= SHORT:
                self._deliver(call, size, *drained(call.values()))
            else:
                self._read(call, size, call.values())

    def _read(
        self, call: CallMessage, size: int, values: Generator[None, None, Values], *, in_turn: bool = False
    ) -> None:
        """Read the values of a long call in steps, so that others get turns; the run charges the first step."""
        if self._host.over:
            return
        began, until = time.thread_time(), time.perf_counter() + STEP
        read: Values | None = None
        try:
            while time.perf_counter() < until:
                next(values)
        except StopIteration as done:
            read = done.value
        except ProtocolViolation as error:
            self._host.abort(error)
            return
        if in_turn:
            self._account.charge(time.thread_time() - began)
        if read is None:
            self._account.queue(partial(self._read, call, size, values, in_turn=True))
        else:
            self._deliver(call, size, *read)

    def _deliver(
        self,
        call: CallMessage | PlainCall,
        size: int,
        args: tuple[object, ...],
        kwargs: Mapping[str, object],
        delay: float | None = None,
    ) -> None:
        """Hand a call to the reader once the call rate allows it, or after ``delay`` if that was asked already."""
        interrupted = False
        if self._history:
            interrupted = self._history[0].body is None
            if not self._replay(call, args, kwargs):
                return
        unit, line = self._position.now
        self._waiting = event = Call(call.id, call.name, args, kwargs, line, unit, interrupted)
        if delay is None:
            delay = self._rate.delay(size)
        if delay > 0:
            self._loop.call_later(delay, self._account.go_on, partial(self._put, event))
        elif self._account.spent:
            self._account.queue(partial(self._put, event))
        else:
            self._host.put(event)

    def _halt(self, id: int) -> None:
        """Report a halt, except during a replay."""
        self._waiting = halted = Halted(id, self._position.line, self._position.unit)
        if self._history:
            self.reply(id)
            return
        self._position.clear_step()
        self._loop.call_later(max(0.0, self._rate.delay()), self._put, halted)

    def _replay(self, call: CallMessage | PlainCall, args: tuple[object, ...], kwargs: Mapping[str, object]) -> bool:
        """Answer a call from the history; return True if it was interrupted there and needs a new answer."""
        known = self._history.popleft()
        if known.name != call.name:
            words = f"the program called {call.name} where it had called {known.name} before"
            self._host.end(ExitReason.DIVERGED, "ReplayDiverged", words)
        elif known.body is None:
            return True
        else:
            self._waiting = None
            self._host.put(Replayed(call.name, args, kwargs, known.body))
            if self.keeps_last and not self._history:
                self._kept = frame(known.body)
            else:
                self._host.write(frame(known.body))
        return False

    def _put(self, event: Call | Halted) -> None:
        if not self._host.over:
            self._host.put(event)

    def _answer(self, id: int, body: bytes, framed: bytes = b"") -> None:
        if len(body) > REPLY_MAX:
            raise ValueError("the value is too large for a program")
        if self._host.over:
            return
        if self._waiting is None or self._waiting.id != id:
            raise LookupError(f"no call {id} is waiting")
        waited, self._waiting = self._waiting, None
        if isinstance(waited, Call) and self.answered is not None:
            self.answered(waited.name, body)
        self._host.write(framed or frame(body))
