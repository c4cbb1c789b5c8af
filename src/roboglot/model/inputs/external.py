"""External inputs other than requests at doors, noted so that a lockstep run can be repeated.

These are changes of the world by hand, commands at the console, answers to calls that a robot makes itself (to a dog's
app), and clients that connect, hang up or cancel their requests.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import NamedTuple

from roboglot.model.client_context import client, connection
from roboglot.model.clock import Clock
from roboglot.model.events.listeners import Failures, call_all

ANSWER = "answer"  # kind: answer to a call that the robot made
CAME, GONE, CALLED_OFF = "came", "gone", "called off"  # kinds: clients; the name is the door's
PATIENCE = 2.0  # s (machine clock) that lockstep time waits for an answer
_carried_out: ContextVar[bool] = ContextVar("carried_out", default=False)


class Input(NamedTuple):
    """One input. ``stamp``: robot time, s; ``turn``: the clock's; ``robot``: empty if it concerns the world.

    ``kind`` names the part of the program that interprets ``name`` and ``values`` (JSON types). ``client`` and
    ``connection``: as in an exchange.
    """

    stamp: float
    turn: int
    robot: str
    kind: str
    name: str
    values: Mapping[str, object]
    client: str = ""
    connection: str = ""


Listener = Callable[[Input], None]


class ExternalInputs:
    """External inputs of one robot, or of a world. Build ``values`` only while they are ``watched``."""

    def __init__(self, robot: str, clock: Clock) -> None:
        self._robot, self._clock = robot, clock
        self._listeners: list[Listener] = []
        self._failures = Failures()
        self._playing = False
        self._asked: Counter[str] = Counter()
        self._waiting: dict[tuple[str, int], asyncio.Future[str]] = {}  # by name and its running number
        self._answers_come = True  # the last request took no longer than PATIENCE

    @property
    def watched(self) -> bool:
        """True while there are listeners, unless a noted input is the cause of what happens now."""
        return bool(self._listeners) and not _carried_out.get()

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call ``listener`` with every input; return a function that unsubscribes it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def note(self, kind: str, name: str, values: Mapping[str, object]) -> None:
        """Pass an input to the listeners."""
        who = ("", "") if kind == ANSWER else (client(), connection())
        self._pass(Input(self._clock.time(), self._clock.turn, self._robot, kind, name, values, *who))

    def note_client(self, kind: str, door: str, where: str, **values: object) -> None:
        """Note that the client at address ``where`` connected, left or cancelled a request."""
        if self._listeners:
            self._pass(Input(self._clock.time(), self._clock.turn, self._robot, kind, door, values, "", where))

    def _pass(self, given: Input) -> None:
        call_all(self._listeners, given, self._failures)

    @contextmanager
    def noting(self, kind: str, name: str, values: Mapping[str, object]) -> Iterator[None]:
        """Note an input; its effects inside ``with`` are not noted as further inputs."""
        if not self.watched:
            yield
            return
        self.note(kind, name, values)
        before = _carried_out.set(True)
        try:
            yield
        finally:
            _carried_out.reset(before)

    # -- answers of external peers --

    async def call_out(self, name: str, work: Callable[[], Awaitable[str]]) -> str:
        """Call an external peer by ``work`` and return its one-word answer, which is noted as an input.

        In a noted lockstep run, time waits for the answer while answers usually come soon, and it is delivered between
        two instants. In a repeated run ``work`` is not started: the recorded answer is returned.
        """
        self._asked[name] += 1
        number = self._asked[name]
        if not (self._clock.repeats and (self._playing or self._listeners)):
            return await work()
        answer: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._waiting[name, number] = answer
        task = None if self._playing else asyncio.ensure_future(work())
        began = asyncio.get_running_loop().time()
        if task is not None:
            if self._answers_come:
                self._clock.hold(answer, PATIENCE)
            task.add_done_callback(lambda done: self._clock.arrive(partial(self._resolve, name, number, done)))
        try:
            return await answer
        finally:
            if task is not None:
                self._answers_come = asyncio.get_running_loop().time() - began < PATIENCE
                self._clock.release(answer)
                task.cancel()
            self._waiting.pop((name, number), None)

    def _resolve(self, name: str, number: int, done: asyncio.Future[str]) -> None:
        """Deliver the outcome of the call ``done``."""
        answer = self._waiting.get((name, number))
        if answer is None or answer.done() or done.cancelled():
            return
        if (error := done.exception()) is not None:
            answer.set_exception(error)
        else:
            self.answer(name, number, done.result())

    def play(self) -> None:
        """Make no calls from now on: ``answer`` supplies the answers."""
        self._playing = True

    def waits(self, name: str, number: int) -> bool:
        """Return whether the robot waits for the answer to call ``number`` of that name."""
        return (name, number) in self._waiting

    def answer(self, name: str, number: int, said: str) -> None:
        """Deliver the answer to that call."""
        answer = self._waiting.pop((name, number))
        if not answer.done():
            self.note(ANSWER, name, {"number": number, "said": said})
            answer.set_result(said)
