"""Reports of the program service: changes of tasks, their positions, and their use of resources. Plain data."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import field
from typing import Generic, ParamSpec

from roboglot.programs.errors import ProgramError
from roboglot.programs.functions.results import StateCode
from roboglot.programs.stores import LogEntry
from roboglot.programs.tasks.states import TaskOperation, TaskState
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class TaskReport:
    """Unrequested report of a change of a task.

    ``error`` is the failure, None for success. In reports of blocks, ``block`` is ("begin" or "end", the block's id)
    and ``block_status`` the status of the last ability call.
    """

    task: str
    operation: TaskOperation
    describe: str
    error: ProgramError | None = None
    block: tuple[str, str] | None = None
    block_status: StateCode = StateCode.SUCCESS


@dataclass(frozen=True, slots=True)
class TaskPosition:
    """State of a task, its current line (in ``module``, or in its own text), and its open block.

    ``watched``: True if it can be stepped through. ``began``: its start, Unix s, from which its log entries count;
    0 for a task that a crash interrupted. ``variables``: the last reported values.
    """

    state: TaskState
    line: int = 0
    module: str = ""
    block: str = ""
    watched: bool = False
    began: float = 0.0
    variables: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Reading:
    """Result of a function at a line of a task (of ``module``, or of its own text), as short text.

    ``refused``: why the robot could not do it; "" if it could.
    """

    task: str
    line: int
    module: str
    block: str
    function: str
    value: str
    refused: str = ""


REFUSED_MAX = 20  # refused calls that are kept of a run


@dataclass(frozen=True, slots=True)
class NewestRun:
    """Record of a run that is kept until the task's next: its start and its first refused calls.

    ``began``: Unix s, 0 for a run that a crash interrupted. A call is kept once for each place and reason.
    """

    began: float
    refused: list[Reading] = field(default_factory=list)

    def note(self, call: Reading) -> None:
        """Keep a call if it was refused."""
        known = [(one.line, one.module, one.refused) for one in self.refused]
        if call.refused and len(known) < REFUSED_MAX and (call.line, call.module, call.refused) not in known:
            self.refused.append(call)


@dataclass(frozen=True, slots=True)
class Variables:
    """Values of a watched task's variables, as short text."""

    task: str
    variables: dict[str, str]


Insight = Reading | Variables


@dataclass(frozen=True, slots=True)
class RunFigures:
    """Resources of a running or suspended task: processor in s, memory in bytes, robot time since its start in s."""

    target_id: str
    state: TaskState
    cpu: float
    memory: int
    age: float


def done(operation: TaskOperation, id: str, state: TaskState) -> TaskReport:
    """Return the second feedback of suspend, recover and shutdown."""
    return TaskReport(id, operation, f"Task loop feedback, now state is {state}")


Report = Callable[[TaskReport], None]
LogListener = Callable[[str, LogEntry], None]


P = ParamSpec("P")
LISTENERS_MAX = 64


class Listeners(Generic[P]):
    """Listeners of one kind of news. They must be quick and must not raise."""

    def __init__(self) -> None:
        self._listeners: list[Callable[P, None]] = []

    def join(self, listener: Callable[P, None]) -> Callable[[], None]:
        """Add a listener; return a function that removes it. Raises RuntimeError if there are too many."""
        if len(self._listeners) >= LISTENERS_MAX:
            raise RuntimeError(f"more than {LISTENERS_MAX} listeners")
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    @property
    def listening(self) -> bool:
        """True if there are listeners; without any, no reports need to be made."""
        return bool(self._listeners)

    def publish(self, *args: P.args, **kwargs: P.kwargs) -> None:
        """Call every listener."""
        for listener in tuple(self._listeners):
            listener(*args, **kwargs)


class Pace:
    """Back-pressure: programs wait for slow front ends before they continue."""

    def __init__(self) -> None:
        self._waits: list[Callable[[], Awaitable[None]]] = []

    def join(self, wait: Callable[[], Awaitable[None]]) -> Callable[[], None]:
        """Add a wait; return a function that removes it."""
        self._waits.append(wait)
        return lambda: self._waits.remove(wait) if wait in self._waits else None

    @property
    def joined(self) -> bool:
        """True if there is anything to wait for."""
        return bool(self._waits)

    async def wait(self) -> None:
        """Wait until every front end has caught up."""
        for wait in tuple(self._waits):
            await wait()
