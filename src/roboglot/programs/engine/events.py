"""Limits, reports and ends of a run: plain data. Knows no process and no robot."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import msgspec


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one run.

    ``memory`` counts bytes beyond an empty program's, ``cpu`` seconds of processor in its whole life (waiting costs
    nothing), ``output`` characters printed in its whole life, ``recursion`` calls inside calls. A program that calls
    the robot more often than ``call_rate`` times a second is slowed down to it, not ended. ``wall`` counts seconds of
    the machine's clock since the start, suspended ones excepted; 0 is no limit.
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

    The host sees to blocks, whose begin it knows. ``first_block``: at the begin of its next block. ``watched`` alone:
    nowhere, but it can be stepped through.
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
    """An error of the program that it didn't catch, or text that isn't a program."""
    KILLED = "killed"
    """``kill`` was called."""
    MEMORY = "memory limit"
    CPU = "cpu limit"
    OUTPUT = "output limit"
    WALL = "time limit"
    DIVERGED = "diverged"
    """A program that was to go on where it had been asked for other things than the first time."""
    PROTOCOL = "protocol"
    """Frames that no program sends: the worker was tampered with from inside.

    Calls without waiting for replies are among them.
    """
    CRASHED = "crashed"
    """The process ended without a word."""
    LOST = "engine lost"
    """The zygote ended, or the engine was closed."""


@dataclass(frozen=True, slots=True)
class Output:
    """Text the program printed; consecutive prints come joined."""

    text: str


class Call(msgspec.Struct, frozen=True):  # one per call: a frozen dataclass takes six times as long to create
    """The program waits for ``reply`` or ``fail`` with this id. The name is one the prelude offers; the values are
    unchecked.

    ``unit`` names the module the line belongs to, "" for the program itself. ``interrupted``: an earlier life of the
    run was lost while this call was under way; how far it came is unknown, and it is not repeated.
    """

    id: int
    name: str
    args: tuple[object, ...]
    kwargs: dict[str, object]
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
    kwargs: dict[str, object]
    answer: bytes


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer to a call of an earlier life of a run: the call's name and the frame's body, None if it was cut off."""

    name: str
    body: bytes | None


@dataclass(frozen=True, slots=True)
class Finished:
    """The program ran to its end."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The program ended otherwise. ``line`` is 0 where no line is to blame; ``source_line`` is that line's text."""

    type: str
    message: str
    line: int
    source_line: str
    reason: ExitReason
    unit: str = ""


Event = Output | Call | Halted | Replayed | Finished | Failed
