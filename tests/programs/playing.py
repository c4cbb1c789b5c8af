"""A way to play a program to its end, for the tests of the program engine."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    Failed,
    Finished,
    Limits,
    Output,
)
from roboglot.programs.engine.run import Run
from roboglot.programs.worker.prelude import Prelude, RecordType
from roboglot.programs.worker.values import Record

PRELUDE = Prelude(
    calls=frozenset({"cyberdog.motion.turn", "cyberdog.motion.go_straight", "cyberdog.echo", "cyberdog.task.block"}),
    attributes=frozenset({"cyberdog.motion.state"}),
    records={
        "State": RecordType({"code": 0, "describe": ""}, aliases={"state": ""}),
        "Reply": RecordType(
            {"state": Record("State"), "list": [1, 2], "dictionary": {}}, aliases={"response": "dictionary"}
        ),
        "Gait": RecordType({"name": "", "points": [Record("Point")]}, constructible=True),
        "Point": RecordType({"x": 0.0, "y": 0.0}, constructible=True),
    },
    enums={"StateCode": {"success": 0, "fail": 1}},
)
BUSY = "n = 0\nprint('ready')\nwhile True:\n    n += 1\n    n -= 1\n"
Answer = Callable[[Run, Call], None]


@dataclass
class Played:
    """Record of a program."""

    output: str = ""
    calls: list[Call] = field(default_factory=list)
    ending: Finished | Failed | None = None
    pid: int = 0


def echo(run: Run, call: Call) -> None:
    """The first argument comes back; the clock stands at 1000 s."""
    value = 1000.0 if call.name in {"time.time", "time.monotonic"} else call.args[0] if call.args else None
    run.calls.reply(call.id, value)


async def play(
    engine: Engine,
    source: str,
    answer: Answer = echo,
    limits: Limits | None = None,
    modules: Mapping[str, str] | None = None,
    seed: int = 1,
) -> Played:
    """Run a program to its end."""
    run = await engine.start(source, PRELUDE, limits or Limits(), modules=modules, seed=seed)
    played = Played(pid=run.pid)
    async for event in run:
        match event:
            case Output(text=text):
                played.output += text
            case Call():
                played.calls.append(event)
                answer(run, event)
            case Finished() | Failed():
                played.ending = event
    await run.wait()
    return played


async def started(engine: Engine, source: str, limits: Limits | None = None) -> Run:
    """Return a run that has printed its first word."""
    run = await engine.start(source, PRELUDE, limits or Limits())
    assert isinstance(await anext(run), Output)
    return run


async def last(run: Run) -> Finished | Failed:
    """Return the end of the run."""
    async for event in run:
        if isinstance(event, (Finished, Failed)):
            return event
    raise AssertionError("the run ended without a last event")


async def until(condition: Callable[[], bool]) -> None:
    """Poll what the kernel does not announce."""
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.001)


def open_descriptors() -> set[tuple[str, str]]:
    """This process's descriptors and what they stand for, less what earlier tests left to the garbage collector."""
    gc.collect()
    found = set()
    for descriptor in os.listdir("/proc/self/fd"):
        with contextlib.suppress(FileNotFoundError):  # this listing's own
            found.add((descriptor, os.readlink(f"/proc/self/fd/{descriptor}")))
    return found


def children_of(pid: int) -> set[int]:
    """Processes whose parent this is."""
    found = set()
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text().rpartition(")")[2].split()
            except (FileNotFoundError, ProcessLookupError):
                continue
            if int(stat[1]) == pid:
                found.add(int(entry.name))
    return found


def process_state(pid: int) -> str:
    """Return the kernel's letter for a process, "" if there is none."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return ""


def answers(**values: Any) -> Answer:
    """Answers by the call's last name part."""

    def answer(run: Run, call: Call) -> None:
        value = values[call.name.rpartition(".")[2]]
        if isinstance(value, Exception):
            run.calls.fail(call.id, type(value).__name__, str(value))
        else:
            run.calls.reply(call.id, value)

    return answer
