"""Runs users' programs, each in a separate process that can only compute and send calls.

A clean zygote is started once and forked for every program; the fork is locked down (system call filter, no files, no
network, limits) before it sees the program's text. Parsing happens in there too. Where the
filter cannot be loaded, ``open``, ``start`` and ``check`` raise SandboxUnavailable with the reason, unless the
configuration allows it.

Knows no robot: programs call names, the reader of the run answers. Runs on the current asyncio loop (or uvloop) and
never blocks.
"""

from __future__ import annotations

import asyncio
import fcntl
import logging
import mmap
import os
import random
import secrets
import signal
import socket
from collections.abc import Coroutine, Mapping, Sequence
from typing import Any, TypeVar

import msgspec

from roboglot.programs.engine.checking import Checking
from roboglot.programs.engine.events import Answer, ExitReason, Limits, Stops
from roboglot.programs.engine.launcher import EngineError, EngineSilent, Launcher, SandboxUnavailable, Worker
from roboglot.programs.engine.memory_budget import MemoryBudget
from roboglot.programs.engine.processor_group import ProcessorGroup
from roboglot.programs.engine.run import Run
from roboglot.programs.engine.share import ThreadShare
from roboglot.programs.engine.shared_page import Page
from roboglot.programs.engine.usage import usage_of
from roboglot.programs.language import Problem, ProblemKind
from roboglot.programs.library.program import Program
from roboglot.programs.worker.frames import frame
from roboglot.programs.worker.link import REPLY_MAX
from roboglot.programs.worker.prelude import Prelude

__all__ = ["Engine", "EngineError", "EngineSilent", "SandboxUnavailable"]

log = logging.getLogger(__name__)
T = TypeVar("T")

FILTER = "seccomp"
"""The layer of the jail that only the operator's settings can make optional."""
RUNS_MAX = 512
"""Programs running at once, suspended and checked ones included."""
MODULES_MAX = 1000
"""Modules of one program."""
ANSWER_MAX = 60.0
"""Longest wait for a worker's start and for a program's check, in the machine's seconds."""
ENDS_MAX = 5.0
"""Longest wait for killed programs before the zygote is ended, in the machine's seconds."""
OPENS_AFTER, OPENS_WITHIN = 5.0, 10.0
"""Delay of ``open_later``, by when doors and worlds that start beside this one are open; how far it is spread by
chance, so that those of many worlds do not hold them up together; in the machine's seconds."""
STEPS_BACK_AFTER = 0.5
"""Delay before a program moves to the control group, which is slow in the kernel, and before the zygote's session
yields, so that the first program begins soon; in the machine's seconds."""

_CHECK_MEMORY, _CHECK_CPU = 256 * 1024 * 1024, 10
_EMPTY = Prelude()
_DEFAULT = Limits()


class Engine:
    """The program engine of a server. ``open``, ``open_soon``, ``open_later`` or the first use starts the zygote.

    ``close`` ends all.

    ``policy=False`` switches the language's rules off and allows all of Python inside the jail; it exists so that
    tests can show that the jail alone holds. ``filter_required=False`` runs programs even if the kernel can't filter
    their system calls; ``layers`` then lacks FILTER. ``memory_together``: bytes for all programs, 0 for the default.
    """

    def __init__(self, *, policy: bool = True, filter_required: bool = True, memory_together: int = 0) -> None:
        self._policy, self._filter_required = policy, filter_required
        self._launcher: Launcher | None = None
        self._opening = asyncio.Lock()
        self._runs: set[Run] = set()
        self._memory = MemoryBudget(self._runs, memory_together)
        self._busy = 0
        self._closed = False
        self._reaping: set[asyncio.Task[None]] = set()
        self._asked: set[asyncio.Task[object]] = set()
        self._background: asyncio.Task[None] | None = None
        self._group = ProcessorGroup()
        self._share = ThreadShare()
        self.layers: list[str] = []
        """Layers of the jail on this machine, once open."""

    async def __aenter__(self) -> Engine:
        await self.open()
        return self

    async def __aexit__(self, *exc: object) -> None:
        await self.close()

    @property
    def running(self) -> int:
        """Number of running programs."""
        return len(self._runs)

    def open_soon(self) -> None:
        """Start the zygote in the background; a failure is raised at the first use."""
        if self._background is None:
            self._background = asyncio.create_task(self._try_open())

    def open_later(self) -> None:
        """Start the zygote in the background once this program has started, so that it takes no time from that."""
        if self._background is None:
            delay = random.uniform(OPENS_AFTER, OPENS_AFTER + OPENS_WITHIN)
            self._background = asyncio.create_task(self._try_open(delay))

    async def open(self) -> None:
        """Start the zygote if it isn't running. Raises SandboxUnavailable, EngineError after ``close``."""
        await self._zygote()

    async def start(
        self,
        source: str,
        prelude: Prelude = _EMPTY,
        limits: Limits = _DEFAULT,
        *,
        modules: Mapping[str, str] | None = None,
        seed: int | None = None,
        history: Sequence[Answer] = (),
        stops: Stops | None = None,
    ) -> Run:
        """Start a program. Errors in its text show as the run's Failed event.

        ``modules`` (name to source) run first, in their order, and share the program's names. ``seed`` fixes
        ``random``. With the ``history`` of a lost run (from ``Run.calls.answered``) and the same program, modules and
        seed, the program continues where that run ended: recorded calls are answered from the history and reported
        as Replayed, and output is repeated. ``stops`` makes the program watched: slower, but it halts there (reported
        as Halted) and can be stepped through. Raises SandboxUnavailable, EngineError (too many runs, no process),
        ValueError (program too large), LookupError (a stop at a line that does not exist).
        """
        modules = modules or {}
        if len(modules) > MODULES_MAX:
            raise ValueError(f"more than {MODULES_MAX} modules")
        program = Program((source, *modules.values()), ("", *modules))
        body = _run_request(program, prelude, limits, policy=self._policy, watched=stops is not None, seed=seed)
        memory, page = _shared_memory(program.places.memory()), None
        try:
            page = Page(memory, program.places)
            names = prelude.callable_names()
            run = Run(program, names, limits, page, history, watched=stops is not None, share=self._share)
            if stops is not None:
                run.position.stop_at(stops.lines)
                if stops.first:
                    run.position.step()
            worker = await self._in_time(self._launch(run.wire, body, memory, limits.memory, limits.cpu))
        except BaseException:
            if page is not None:
                page.close()
            raise
        finally:
            os.close(memory)
        self._runs.add(run)
        run.attach(worker)
        self._memory.watch()
        worker.died.add_done_callback(lambda _: self._runs.discard(run))
        asyncio.get_running_loop().call_later(STEPS_BACK_AFTER, self._step_back, worker)
        return run

    async def check(
        self, source: str, prelude: Prelude = _EMPTY, *, functions: frozenset[str] = frozenset()
    ) -> list[Problem]:
        """Return the problems of a program, found by a jailed worker; ``functions``: names defined by its modules.

        Raises as ``start``.
        """
        problems, _ = await self.examine(source, prelude, functions=functions)
        return problems

    async def examine(
        self, source: str, prelude: Prelude = _EMPTY, *, functions: frozenset[str] = frozenset()
    ) -> tuple[list[Problem], frozenset[str]]:
        """Return the problems and those of ``functions`` that the program uses (none if it cannot be parsed)."""
        return await self._in_time(self._examine(source, prelude, functions))

    async def _examine(
        self, source: str, prelude: Prelude, functions: frozenset[str]
    ) -> tuple[list[Problem], frozenset[str]]:
        request = {
            "t": "check",
            "source": source.encode("utf-8", "replace").decode(),
            "prelude": prelude.to_wire(),
            "functions": sorted(functions),
        }
        checking = Checking()
        memory = _shared_memory(mmap.PAGESIZE)
        try:
            worker = await self._launch(checking.wire, _body(request), memory, _CHECK_MEMORY, _CHECK_CPU)
        finally:
            os.close(memory)
        try:
            await checking.closed
        finally:
            checking.wire.drop()
            worker.signal(signal.SIGKILL)
            await asyncio.shield(worker.died)
        if checking.problems is None:
            english, chinese = "The program is too complicated to be checked.", "程序太复杂，无法检查。"
            return [Problem(1, 1, ProblemKind.SIZE, english, chinese)], frozenset()
        return checking.problems, functions.intersection(checking.uses)

    async def close(self) -> None:
        """End every run and the zygote, and remove their resources. Idempotent."""
        self._closed = True
        if self._background is not None:
            self._background.cancel()  # a zygote that is still loading has no state to lose
            await asyncio.gather(self._background, return_exceptions=True)
        for run in list(self._runs):
            run.end(ExitReason.LOST, "EngineLost", "the program engine was closed")
            run.wire.drop()
        ends = [asyncio.ensure_future(run.wait()) for run in self._runs]
        if ends:
            await asyncio.wait(ends, timeout=ENDS_MAX)
        await self._memory.close()
        await asyncio.gather(*self._reaping)
        launcher, self._launcher = self._launcher, None
        if launcher is not None:
            await launcher.close()  # and all remaining workers
        await asyncio.gather(*ends, *self._asked, return_exceptions=True)
        await asyncio.to_thread(self._group.close)

    async def _try_open(self, delay: float = 0.0) -> None:
        await asyncio.sleep(delay)  # noqa: TID251 - the machine starts, not the robot
        try:
            await self.open()
        except (SandboxUnavailable, EngineError):
            return  # the next start of a program raises it again

    async def _zygote(self) -> Launcher:
        async with self._opening:
            if self._closed:
                raise EngineError("the program engine is closed")
            if self._launcher is None:
                launcher = Launcher(self._forget, filter_required=self._filter_required)
                self.layers = await launcher.open()
                self._launcher = launcher
                self.layers = [*self.layers, *await self._open_group()]
                asyncio.get_running_loop().call_later(STEPS_BACK_AFTER, self._step_aside, launcher)
                self._memory.empty = usage_of(launcher.pid).memory
                if FILTER not in self.layers:
                    log.warning(
                        "robot programs run without a system call filter, as configured: run trusted programs only"
                    )
            return self._launcher

    async def _open_group(self) -> list[str]:
        """Open the control group; a cancellation waits for the end, so that ``close`` finds the group."""
        opening = asyncio.ensure_future(asyncio.to_thread(self._group.open))
        try:
            return await asyncio.shield(opening)
        except asyncio.CancelledError:
            await opening
            raise

    def _forget(self, launcher: Launcher) -> None:
        """Forget a zygote that ended by itself; the next program starts another."""
        if self._launcher is launcher:
            self._launcher = None
            reaping = asyncio.get_running_loop().create_task(launcher.close())
            self._reaping.add(reaping)
            reaping.add_done_callback(self._reaping.discard)

    async def _launch(
        self, protocol: asyncio.Protocol, body: bytes, memory: int, memory_limit: int, cpu_limit: int
    ) -> Worker:
        if self._busy >= RUNS_MAX:
            raise EngineError(f"{RUNS_MAX} programs are running already")
        ours, theirs = socket.socketpair()
        self._busy += 1
        worker = None
        try:
            with theirs:
                launcher = await self._zygote()
                worker = await launcher.spawn(theirs, memory, memory_limit=memory_limit, cpu_limit=cpu_limit)
            worker.died.add_done_callback(lambda _: self._release())
            ours.setblocking(False)
            transport, _ = await asyncio.get_running_loop().create_unix_connection(lambda: protocol, sock=ours)
        except BaseException:
            ours.close()  # a worker that was forked already detects this and exits
            if worker is None:
                self._release()
            raise
        transport.write(frame(body))
        return worker

    async def _in_time(self, work: Coroutine[object, None, T]) -> T:
        """Return the result of ``work``. Raises EngineSilent after ``ANSWER_MAX``, as a worker may never start."""
        task = asyncio.ensure_future(work)
        self._asked.add(task)
        task.add_done_callback(self._asked.discard)
        try:
            done, _ = await asyncio.wait({task}, timeout=ANSWER_MAX)
        finally:
            task.cancel()
        if not done:
            raise EngineSilent(f"the program engine did not answer for {ANSWER_MAX:g} s")
        return task.result()

    def _step_aside(self, launcher: Launcher) -> None:
        """Let the zygote's session yield."""
        if self._launcher is launcher:
            self._group.step_aside(launcher.pid)

    def _step_back(self, worker: Worker) -> None:
        """Move a program that is still running to the control group."""
        if self._group.there and not worker.died.done() and self._launcher is not None and not self._closed:
            moving = asyncio.get_running_loop().create_task(
                asyncio.to_thread(self._group.take, worker.pid, self._launcher.pid)
            )
            self._reaping.add(moving)
            moving.add_done_callback(self._reaping.discard)

    def _release(self) -> None:
        self._busy -= 1


def _run_request(
    program: Program, prelude: Prelude, limits: Limits, *, policy: bool, watched: bool, seed: int | None
) -> bytes:
    return _body(
        {
            "t": "run",
            "units": [unit.encode("utf-8", "replace").decode() for unit in program.units],
            "prelude": prelude.to_wire(),
            "policy": policy,
            "recursion": limits.recursion,
            "watched": watched,
            "seed": secrets.randbits(63) if seed is None else seed,
        }
    )


def _body(request: dict[str, Any]) -> bytes:
    body = msgspec.json.encode(request)
    if len(body) > REPLY_MAX:
        raise ValueError("the program and what is offered to it are too large")
    return body


def _shared_memory(size: int) -> int:
    """Return shared memory of a sealed size."""
    descriptor = os.memfd_create("line", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.ftruncate(descriptor, size)
    fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL)
    return descriptor
