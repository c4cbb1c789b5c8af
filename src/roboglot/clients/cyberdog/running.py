"""A running task of 6004: feedback, result and cancellation. Independent of the kind of task."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Generator
from contextlib import aclosing

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, NoAnswer, decode
from roboglot.clients.errors import ClientError, LinkLost, TimedOut
from roboglot.wire.cyberdog.codes import Accepted, Code, TaskResult, TaskType

LOST_MAX = 20.0  # s without a stream before waiting fails
REJOIN_PERIOD = 0.5  # s between two attempts to rejoin the task
STOP_MAX = 65.0  # s: the robot itself gives up after 60
ACCEPT_MAX = 10.0  # s


class TaskFailed(ClientError):
    """The task failed; ``feedback``: the robot's last code, which gives the reason."""

    def __init__(self, kind: TaskType, result: int, feedback: int) -> None:
        super().__init__(f"{kind.name.lower().replace('_', ' ')} ended with {result} after feedback {feedback}")
        self.kind, self.result, self.feedback = kind, result, feedback


class TaskStopped(TaskFailed):
    """The task was stopped: by this app, another one or an empty battery."""


class _Message(msgspec.Struct):
    accepted: int | None = None
    feedback_code: int | None = None
    result: int | None = None


class RunningTask:
    """A running task; awaiting it returns once it has succeeded. Raises TaskFailed, TaskStopped or LinkLost otherwise.

    A broken stream is joined again; the task continues meanwhile.
    """

    def __init__(self, calls: Calls, kind: TaskType, on_feedback: Callable[[int], object] | None) -> None:
        self.kind = kind
        self.feedback = 0  # the latest code
        self.result: int | None = None
        self._calls, self._on_feedback = calls, on_feedback
        self._accepted: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._reading: asyncio.Task[None] | None = None

    def __await__(self) -> Generator[object, None, None]:
        return self.succeeded().__await__()

    @property
    def ended(self) -> bool:
        """True once the task has ended."""
        return self._reading is not None and self._reading.done()

    async def begin(self, code: Code, params: dict[str, object]) -> None:
        """Start or join the task. Raises CyberDogRefused if the robot does not accept it, TimedOut, LinkLost."""
        self._reading = asyncio.get_running_loop().create_task(self._read(code, params), name=f"task {self.kind.name}")
        self._reading.add_done_callback(_noticed)
        try:
            await self._calls.clock.wait_for(self._accepted, ACCEPT_MAX)
        except TimeoutError:
            self.leave()
            raise TimedOut(f"{code.name}: not accepted within {ACCEPT_MAX:g} s") from None

    async def succeeded(self) -> None:
        """Wait for success. Raises TaskFailed, TaskStopped, LinkLost."""
        assert self._reading is not None
        await asyncio.shield(self._reading)
        if self.result == TaskResult.SUCCESS:
            return
        kind = TaskStopped if self.result == TaskResult.CANCELED else TaskFailed
        raise kind(self.kind, -1 if self.result is None else self.result, self.feedback)

    async def cancel(self, **more: object) -> None:
        """Stop the task and wait until the robot stands. Raises CyberDogRefused, TimedOut."""
        await self._calls.do(Code.STOP_TASK, {"type": int(self.kind), **more}, within=STOP_MAX)

    def leave(self) -> None:
        """Stop following the task, which continues."""
        if self._reading:
            self._reading.cancel()

    async def _read(self, code: Code, params: dict[str, object]) -> None:
        try:
            await self._stream(self._calls.answers(code, params))
        except ClientError as error:
            if not self._accepted.done():
                self._accepted.set_exception(error)
                return
            if not isinstance(error, LinkLost):
                raise
        if self.result is None:
            await self._rejoin()

    async def _rejoin(self) -> None:
        """Follow the task until it ends, or the robot has nothing to join. Raises LinkLost after ``LOST_MAX`` s."""
        lost = self._calls.clock.time()
        while self.result is None:
            try:
                await self._stream(self._calls.answers(Code.JOIN_TASK, {"type": int(self.kind)}))
                lost = self._calls.clock.time()
            except (CyberDogRefused, NoAnswer):
                return  # it ended while the stream was down
            except LinkLost:
                if self._calls.clock.time() - lost > LOST_MAX:
                    raise
            await self._calls.clock.sleep(REJOIN_PERIOD)

    async def _stream(self, answers: AsyncGenerator[str, None]) -> None:
        async with aclosing(answers) as messages:
            async for text in messages:
                message = decode(text, _Message, Code.START_TASK)
                if message.accepted is not None:
                    self._accept(message.accepted)
                if message.feedback_code is not None:
                    self.feedback = message.feedback_code
                    if self._on_feedback:
                        self._on_feedback(self.feedback)
                if message.result is not None:
                    self.result = message.result
        if not self._accepted.done():
            raise NoAnswer("the robot answered nothing")

    def _accept(self, accepted: int) -> None:
        if accepted != Accepted.YES:
            words = "nothing to join" if accepted == Accepted.NOTHING_TO_JOIN else "not accepted now"
            raise CyberDogRefused(self.kind.name, accepted, words)
        if not self._accepted.done():
            self._accepted.set_result(None)


def _noticed(reading: asyncio.Task[None]) -> None:
    """Mark the error as retrieved, as ``succeeded`` raises it."""
    if not reading.cancelled():
        reading.exception()
