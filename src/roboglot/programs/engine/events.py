"""Limits, reports and ends of a run: plain data. Knows no process and no robot."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

import msgspec

from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one run.

    ``memory``: bytes beyond those of an empty program; ``cpu``: processor seconds in all (waiting costs nothing);
    ``output``: printed characters in all; ``recursion``: depth of calls; ``call_rate``: calls of the robot a second,
    a faster program is slowed down, not ended. ``wall``: seconds of the machine's clock since the start, without
    suspensions; 0: no limit.
    """

    memory: int = 64 * 1024 * 1024
    cpu: int = 300
    output: int = 4 * 1024 * 1024
    recursion: int = 1000
    call_rate: int = 2000
    wall: float = 0.0

    def __post_init__(self) -> None:
        if min(self.memory, self.cpu, self.output, self.recursion, self.call_rate) < 1:
            raise ValueError("a limit of a program must be at least 1")
        if not self.wall >= 0:
            raise ValueError("the time limit of a program cannot be below 0")


@dataclass(frozen=True, slots=True)
class Stops:
    """Stops of a watched program: ``lines`` of a module or of the program (""), ``blocks``, its ``first`` statement.

    ``first_block``: the beginning of its next block. ``watched`` alone: no stops, but stepping is possible. The engine
    handles lines; the host handles blocks, as it knows where they begin.
    """

    lines: frozenset[tuple[str, int]] = frozenset()
    blocks: frozenset[str] = frozenset()
    first: bool = False
    first_block: bool = False
    watched: bool = False


class ExitReason(StrEnum):
    """Reason for the end of a run."""

    FINISHED = "finished"
    ERROR = "error"
    """An uncaught error of the program, or text that isn't a program."""
    KILLED = "killed"
    """``kill`` was called."""
    MEMORY = "memory limit"
    CPU = "cpu limit"
    OUTPUT = "output limit"
    WALL = "time limit"
    DIVERGED = "diverged"
    """A replayed program made other calls than in its history."""
    PROTOCOL = "protocol"
    """Frames that no intact worker sends: a program tampered with it.

    Example: a call before the reply to the last one.
    """
    CRASHED = "crashed"
    """The process ended without a report."""
    LOST = "engine lost"
    """The zygote ended, or the engine was closed."""


@dataclass(frozen=True, slots=True)
class Output:
    """Text the program printed; consecutive prints come joined."""

    text: str


class Call(msgspec.Struct, frozen=True):  # one per call: a frozen dataclass takes six times as long to create
    """A call; the program waits for ``reply`` or ``fail`` with this id. The prelude offers the name.

    ``args`` and ``kwargs`` are unchecked. ``unit``: module of the line, "" for the program itself. ``interrupted``: the
    server ended during this call in an earlier run; its progress is unknown, and it is not repeated.
    """

    id: int
    name: str
    args: tuple[object, ...]
    kwargs: Mapping[str, object]
    line: int
    unit: str = ""
    interrupted: bool = False


@dataclass(frozen=True, slots=True)
class Halted:
    """A watched program halts before the statement at ``line``, waiting for ``reply`` with this id."""

    id: int
    line: int
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Replayed:
    """A call that was answered from the run's history; nothing is waiting."""

    name: str
    args: tuple[object, ...]
    kwargs: Mapping[str, object]
    answer: bytes


@dataclass(frozen=True, slots=True)
class Answer:
    """Recorded answer to a call of an interrupted run: the call's name and the frame's body, None without an answer."""

    name: str
    body: bytes | None


@dataclass(frozen=True, slots=True)
class Finished:
    """The program ran to its end."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The program ended early. ``line``: its last line, 0 if unknown; ``source_line``: the text of that line."""

    type: str
    message: str
    line: int
    source_line: str
    reason: ExitReason
    unit: str = ""


Event = Output | Call | Halted | Replayed | Finished | Failed
