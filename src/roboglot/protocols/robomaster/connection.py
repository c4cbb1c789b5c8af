"""One client on the control port: reads commands, answers each in order with one write, detects a hang-up."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Mapping
from contextvars import Context as Variables
from contextvars import copy_context
from functools import cache
from types import MappingProxyType
from typing import cast

from roboglot.model.components.system.link import Link
from roboglot.model.inputs.external import CAME, GONE
from roboglot.model.inputs.fairness import Fairness, Use
from roboglot.model.response_delay import delay_response
from roboglot.protocols.robomaster.answers import Answer, FastPath
from roboglot.protocols.robomaster.context import Context, act_as
from roboglot.protocols.robomaster.dispatch import DOOR, answer, fast_path
from roboglot.protocols.robomaster.foreign_protocols import Greeting, turn_away_strangers
from roboglot.protocols.robomaster.keepalive import hung_up, probe_for_life
from roboglot.protocols.robomaster.limits import (
    BATCH_MAX,
    COMMANDS_MAX,
    CONTROL_CONNECTIONS_MAX,
    EXPLANATIONS_MAX,
    LEFT_PERIOD,
    LINES_MAX,
    OUTPUT_MAX,
    TEXT_SHOWN_MAX,
)
from roboglot.protocols.robomaster.liveness import DrivingClient
from roboglot.protocols.robomaster.stops import stops
from roboglot.protocols.robomaster.unfinished import Unfinished
from roboglot.transport.eager import begin
from roboglot.wire.robomaster.lines import END, LineSplitter

log = logging.getLogger(__name__)
NOTHING: Mapping[bytes, FastPath] = MappingProxyType({})


class ControlConnection(asyncio.Protocol):
    """Control connection; detects a hang-up even during a long command, and while reading is paused.

    A line that repeats an earlier one of the session and needs only a plain call is answered as it is received; all
    others are split, queued and answered in turn.
    """

    transport: asyncio.Transport
    host: str
    driver: DrivingClient
    _name: str  # host and port of the client
    _use: Use  # of the program's time
    _variables: Variables  # in which its commands run
    _shown: str  # in the log: its identity if known, and its host

    def __init__(
        self,
        context: Context,
        connections: set[ControlConnection],
        explain: Callable[[Callable[[], str]], None],
        *,
        lenient: bool = False,
        line_end: bytes = b"",
    ) -> None:
        self._context = context
        self._connections = connections
        self._explain = explain
        self._lenient = lenient  # text without a final `;` is executed at once
        self._line_end = line_end  # sent after each answer; used on serial lines
        self._splitter = LineSplitter()
        self._unfinished = Unfinished(self._explain_end)
        self._greeting = Greeting()
        self._commands: deque[str | None] = deque()
        self._resting: asyncio.TimerHandle | None = None  # while reading is paused
        self._worker: asyncio.Task[None] | None = None
        self._turn: asyncio.TimerHandle | None = None  # while other clients come first
        self._writable = asyncio.Event()
        self._writable.set()
        self._explained = 0
        self._repeated = (
            NOTHING  # lines that may be answered at once; none before it has joined, or while a command waits
        )

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport = cast(asyncio.Transport, transport)  # uvloop's transport does not inherit from it
        peer = transport.get_extra_info("peername")
        if not peer:  # already disconnected
            transport.abort()
            return
        self.host, self._name = peer[0], f"{peer[0]}:{peer[1]}"
        who = self._context.robot.admission.cached_identity(self._name)
        self._shown = f"{who} at {self.host}" if who else self.host
        if len(self._connections) >= CONTROL_CONNECTIONS_MAX:
            log.warning("robomaster: refused %s: %d connections are open", self.host, len(self._connections))
            transport.abort()
            return
        self.driver = DrivingClient(self._name, self.host, transport.get_extra_info("socket"))
        fairness = self._context.robot.fairness
        self._use = fairness.of(self._name) if fairness else Use(self._name)
        self._variables = copy_context()
        self._variables.run(act_as, self._name, who or "")
        self._connections.add(self)
        transport.set_write_buffer_limits(high=OUTPUT_MAX)
        probe_for_life(transport)
        self._greeting.known = transport.get_extra_info("sockname") is None  # a serial line: browsers cannot reach it
        self._context.robot.inputs.note_client(CAME, DOOR, self._name)
        log.info("robomaster: %s connected", self._shown)

    def data_received(self, data: bytes) -> None:
        if (repeated := self._repeated.get(data)) is not None and (reply := self._repeat(repeated)) is not None:
            if type(reply) is bytes:
                self.transport.write(reply + self._line_end)
            else:
                self._reply(data[:-1].decode(errors="replace").strip(), cast(Answer, reply))
        else:
            self._read(data)

    def _repeat(self, repeated: FastPath) -> object:
        """Return the answer to a repeated line; None if the line must be parsed."""
        use = self._use
        if not use.left:
            fairness = self._context.robot.fairness
            return fairness.timed(use, lambda: self._variables.run(repeated)) if fairness else None
        if (reply := self._variables.run(repeated)) is not None:
            use.left -= 1
        return reply

    def _read(self, data: bytes) -> None:
        """Queue the lines in ``data``, and answer those that need not wait."""
        whole = self._greeting.known and not self._splitter.within and data.find(END) == len(data) - 1
        self._repeated = NOTHING
        texts = list(self._splitter.feed(turn_away_strangers(self._greeting, self.transport, data)))
        if self._lenient and self._splitter.pending and (rest := self._splitter.flush()) != "":
            texts.append(rest)
        self._unfinished.note(waiting=bool(self._splitter.begun))
        self._commands.extend(texts)
        self._throttle()
        if self._turn and any(map(stops, texts)):
            self._turn.cancel()
            self._turn = None
        self._go_on()
        if whole and texts and texts[0]:
            self._learn(data, texts[0])

    def _learn(self, data: bytes, text: str) -> None:
        """Cache the function that answers this line, for its repetitions."""
        known = self._context.repeated
        if data not in known and (repeated := fast_path(self._context, text)) is not None:
            if len(known) >= LINES_MAX:
                known.clear()
            known[data] = repeated

    def connection_lost(self, _exc: Exception | None) -> None:
        if self not in self._connections:
            return
        self._connections.discard(self)
        self._context.robot.inputs.note_client(GONE, DOOR, self._name)
        self._repeated = NOTHING
        self._unfinished.note(waiting=False)
        self._commands.clear()
        if self._resting:
            self._resting.cancel()
        if self._worker:
            self._worker.cancel()
        if self._turn:
            self._turn.cancel()
        self._context.stop_speaker(self._name)
        self._context.leave(self)
        log.info("robomaster: %s disconnected", self._shown)

    def pause_writing(self) -> None:
        self._writable.clear()
        self._repeated = NOTHING

    def resume_writing(self) -> None:
        self._writable.set()

    def _throttle(self) -> None:
        """Pause reading while many commands are queued, so that TCP slows down a client that sends too fast.

        A paused connection does not report a hang-up, so it is polled for one.
        """
        if self._resting is None and len(self._commands) >= COMMANDS_MAX:
            self.transport.pause_reading()
            self._resting = asyncio.get_running_loop().call_later(LEFT_PERIOD, self._look)
        elif self._resting is not None and len(self._commands) <= COMMANDS_MAX // 2:
            self._resting.cancel()
            self._resting = None
            if not self.transport.is_closing():
                self.transport.resume_reading()

    def _look(self) -> None:
        """Drop the pending answers of a paused client that has hung up."""
        if hung_up(self.transport):
            self.transport.abort()
        else:
            self._resting = asyncio.get_running_loop().call_later(LEFT_PERIOD, self._look)

    def _go_on(self, finished: asyncio.Task[None] | None = None) -> None:
        """Execute queued commands; those that must wait continue in a task."""
        if finished is not None:
            self._worker = None
        if not self._commands or self._worker is not None or self._turn or self.transport.is_closing():
            return
        fairness, use = self._context.robot.fairness, self._use
        if fairness is None:
            self._begin()
        elif (seconds := fairness.wait(use)) and not self._hurries(fairness, use):
            self._turn = asyncio.get_running_loop().call_later(seconds, self._take_turn)
        else:
            begun = fairness.now()
            self._begin()
            fairness.lend(use, fairness.now() - begun)

    def _hurries(self, fairness: Fairness, use: Use) -> bool:
        return any(map(stops, self._commands)) and fairness.hurries(use, min(len(self._commands), BATCH_MAX))

    def _take_turn(self) -> None:
        self._turn = None
        self._go_on()

    def _begin(self) -> None:
        self._worker = begin(self._work(), f"robomaster {self.host}", self._variables.copy())
        if self._worker is not None:
            self._worker.add_done_callback(self._go_on)
        elif self._commands:
            asyncio.get_running_loop().call_soon(self._go_on)

    async def _work(self) -> None:
        """Answer queued commands, a bounded number at a time, so that other clients get their turn."""
        if self._context.robot.admission.enforced:  # it may have proved more since
            act_as(self._name, self._context.robot.admission.cached_identity(self._name) or "")
        for _ in range(BATCH_MAX):
            if not self._commands:
                return
            await self._writable.wait()
            await self._answer(self._commands.popleft())
            self._throttle()

    async def _answer(self, text: str | None) -> None:
        self._join()
        result = await answer(self._context, text)
        self._join()
        await delay_response(self._context.robot)
        self._reply(text, result)
        if not self._commands and not self._splitter.within and self._writable.is_set():
            self._repeated = self._context.repeated

    def _reply(self, text: str | None, result: Answer) -> None:
        self.transport.write(result.reply + self._line_end)
        if result.explain or result.warn:
            explained = cache(lambda: self._refusal(text, result))
            self._explain(explained)
            if self._explained < EXPLANATIONS_MAX and not self._is_lost(result):
                self._explained += 1
                log.warning("robomaster: %s", explained())

    def _is_lost(self, result: Answer) -> bool:
        """Return whether the lost link to a real robot, which its driver has logged, is the reason."""
        robot = self._context.robot
        return Link in robot and result.why == str(robot[Link].refusal)

    def _refusal(self, text: str | None, result: Answer) -> str:
        shown = "(a text)" if text is None else repr(text[:TEXT_SHOWN_MAX])
        why = result.warn() if result.warn else result.why
        return f"{self._shown} asked {shown}: {result.reply.decode()} ({why})"

    def _explain_end(self) -> None:
        """Say why a text without its ``;`` is not answered."""
        why = "every command ends in ';'" + ("" if self._line_end else "; --robomaster-lenient runs those without, too")
        text = f"{self._shown} sent {self._splitter.begun[:TEXT_SHOWN_MAX]!r} and no ';' behind it: {why}"
        self._explain(lambda: text)
        log.warning("robomaster: %s", text)

    def _join(self) -> None:
        """Join the session: a command in SDK mode keeps the robot there."""
        if self._context.active:
            self._context.join(self, self.host)
