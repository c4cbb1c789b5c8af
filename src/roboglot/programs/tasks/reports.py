"""What the program service tells whoever listens: things that happened to a task, and refusals. Plain data."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Generic, ParamSpec

from roboglot.programs.tasks.states import TaskOperation, TaskState
from roboglot.storage.programs import LogEntry
from roboglot.wire.visual.codes import FeedbackState


@dataclass(frozen=True, slots=True)
class TaskReport:
    """Something happened to a task by itself. ``state`` is a FeedbackState, on block reports an ability's StateCode.

    ``block`` is ("begin" or "end", the block's id), or None.
    """

    task: str
    operation: TaskOperation
    state: int
    describe: str
    block: tuple[str, str] | None = None


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """A task's state, the line it is at (in ``module``, or in its own text), and the block that is open.

    ``watched``: whether it can be stepped through.
    """

    state: TaskState
    line: int = 0
    module: str = ""
    block: str = ""
    watched: bool = False


@dataclass(frozen=True, slots=True)
class RunFigures:
    """A task that runs or is suspended: seconds of processor, bytes of memory, and s of robot time since its start."""

    target_id: str
    state: TaskState
    cpu: float
    memory: int
    age: float


def done(operation: TaskOperation, id: str, state: TaskState) -> TaskReport:
    """The second feedback of suspend, recover and shutdown."""
    return TaskReport(id, operation, 0, f"Task loop feedback, now state is {state}")


Report = Callable[[TaskReport], None]
LogListener = Callable[[str, LogEntry], None]


P = ParamSpec("P")
LISTENERS_MAX = 64


class Audience(Generic[P]):
    """Those who want to hear of something. Listeners must be quick and must not raise."""

    def __init__(self) -> None:
        self._listeners: list[Callable[P, None]] = []

    def join(self, listener: Callable[P, None]) -> Callable[[], None]:
        """Hear it from now on; returns what ends it. Raises RuntimeError: too many listen."""
        if len(self._listeners) >= LISTENERS_MAX:
            raise RuntimeError(f"more than {LISTENERS_MAX} listen already")
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def tell(self, *args: P.args, **kwargs: P.kwargs) -> None:
        """Everybody hears it."""
        for listener in tuple(self._listeners):
            listener(*args, **kwargs)


class Pace:
    """What programs wait for before they go on: whoever watches them and is behind."""

    def __init__(self) -> None:
        self._waits: list[Callable[[], Awaitable[None]]] = []

    def join(self, wait: Callable[[], Awaitable[None]]) -> Callable[[], None]:
        """Have programs wait for it from now on; returns what ends it."""
        self._waits.append(wait)
        return lambda: self._waits.remove(wait) if wait in self._waits else None

    async def wait(self) -> None:
        """Until nobody is behind."""
        for wait in tuple(self._waits):
            await wait()


class Refusal(Exception):
    """An operation is not done; ``state`` is the number and the message the words for it."""

    def __init__(self, state: FeedbackState, message: str) -> None:
        super().__init__(message)
        self.state = state
