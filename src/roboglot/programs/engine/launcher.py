"""The server's end of the zygote process: starts it, requests workers, reads its reports; it ends with its socket.

Never blocks the running loop (asyncio or uvloop). Knows no program: a worker is a number, a socket and a signal handle.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from dataclasses import field
from pathlib import Path
from typing import Literal

import msgspec

from roboglot.programs.worker.frames import CONTROL_MAX
from roboglot.values import dataclass

_BOOT = """
import gc, os, sys
gc.disable()  # until all is loaded: that leaves hardly any garbage
sys.path.insert(0, sys.argv[1])
from roboglot.programs.worker import zygote
zygote.main(int(sys.argv[2]), filter_required=sys.argv[3] == "filter")
os._exit(0)  # all is said: to take the interpreter apart would only let the server wait
"""
# With our own environment these are equivalent to -I, but allow a fixed hash seed: two runs of a program then
# iterate its sets in the same order.
_FLAGS = ["-s", "-S", "-P"]
_ENVIRONMENT = {"PYTHONHASHSEED": "0"}
EXIT_MAX = 5.0
"""Longest wait for the zygote to end by itself, in the machine's seconds."""
_HERE = Path(__file__).resolve().parents[3]


class SandboxUnavailable(RuntimeError):
    """This machine cannot confine programs, so none is run; the text says what is missing."""


class EngineError(RuntimeError):
    """A worker could not be started; the text says why."""


class EngineSilent(EngineError):
    """The engine did not answer in time."""


class _Message(msgspec.Struct):
    event: Literal["ready", "unavailable", "born", "refused", "stopped", "continued", "dead"]
    run: int = 0
    pid: int = 0
    status: int = 0
    cpu: float = 0.0
    message: str = ""
    layers: list[str] = []


_decode = msgspec.json.Decoder(_Message).decode


@dataclass(frozen=True, slots=True)
class Death:
    """End of a worker: exit code, or minus the signal; None if unknown. ``cpu`` in seconds."""

    status: int | None
    cpu: float = 0.0


@dataclass(slots=True)
class Worker:
    """One forked process: its last reported state, and the handle for its signals."""

    number: int
    died: asyncio.Future[Death]
    born: asyncio.Future[None]
    pid: int = 0
    stopped: bool = False
    _handle: int = -1
    _changed: asyncio.Event = field(default_factory=asyncio.Event)

    def signal(self, number: int) -> None:
        """Send a signal; nothing happens if the process has ended."""
        if self._handle >= 0:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, number)

    async def until(self, *, stopped: bool) -> None:
        """Wait until the kernel has confirmed that the process is stopped (or runs again), or has ended."""
        while self.stopped is not stopped and not self.died.done():
            self._changed.clear()
            await self._changed.wait()

    def _take_handle(self, handle: int) -> None:
        self._handle = handle

    def _set_stopped(self, stopped: bool) -> None:
        self.stopped = stopped
        self._changed.set()

    def _end(self, death: Death) -> None:
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
        if not self.died.done():
            self.died.set_result(death)
        self._changed.set()


class Launcher:
    """One zygote. ``await open()``, then ``spawn``; ``await close()`` ends the zygote and with it every worker."""

    def __init__(self, on_lost: Callable[[Launcher], None], *, filter_required: bool = True) -> None:
        self._on_lost, self._filter_required = on_lost, filter_required
        self._process: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None
        self._ready: asyncio.Future[list[str]]
        self._loop: asyncio.AbstractEventLoop
        self._workers: dict[int, Worker] = {}
        self._outbox: deque[tuple[bytes, list[int]]] = deque()
        self._numbers = 0
        self.pid = 0

    async def open(self) -> list[str]:
        """Start the zygote; return the names of its jail's layers. Raises SandboxUnavailable."""
        self._loop = asyncio.get_running_loop()
        self._ready = self._loop.create_future()
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setblocking(False)
        self._control = ours
        try:
            with theirs:
                # Not left halfway, however often this is cancelled: the zygote would inherit any file that reuses the
                # descriptor's number.
                starting = asyncio.ensure_future(
                    asyncio.to_thread(_start_process, theirs.fileno(), self._filter_required)
                )
                cancelled: asyncio.CancelledError | None = None
                while not starting.done():
                    try:
                        await asyncio.wait([starting])
                    except asyncio.CancelledError as error:
                        cancelled = error
                self._process = starting.result()
                if cancelled is not None:
                    raise cancelled
            self._loop.add_reader(ours.fileno(), self._receive)
            return await self._ready
        except BaseException:
            self._ready.cancel()  # the caller has stopped waiting
            if self._process is not None:
                self._process.kill()  # a zygote without workers, which may not read its socket for seconds
            await self.close()
            raise

    async def spawn(self, connection: socket.socket, memory: int, *, memory_limit: int, cpu_limit: int) -> Worker:
        """Fork a worker that owns the given socket and shared memory (the caller closes its copies).

        Raises EngineError.
        """
        self._numbers += 1
        worker = Worker(self._numbers, self._loop.create_future(), self._loop.create_future())
        self._workers[worker.number] = worker
        request = {"run": worker.number, "memory": memory_limit, "cpu": cpu_limit}
        # Duplicates: the caller may be cancelled and close its own before the message is sent.
        self._outbox.append((msgspec.json.encode(request), [os.dup(connection.fileno()), os.dup(memory)]))
        self._flush()
        try:
            await asyncio.shield(worker.born)
        except asyncio.CancelledError:
            worker.born.add_done_callback(
                lambda born: None if born.cancelled() or born.exception() else worker.signal(signal.SIGKILL)
            )
            raise
        return worker

    async def close(self) -> None:
        """End the zygote; its workers are killed by the kernel. Idempotent."""
        self._lose()
        process, self._process = self._process, None
        if process is not None:
            await asyncio.to_thread(_wait_process, process)

    def _flush(self) -> None:
        control = self._control
        if control is None:
            self._lose()
            return
        while self._outbox:
            message, descriptors = self._outbox[0]
            try:
                socket.send_fds(control, [message], descriptors)
            except (BlockingIOError, InterruptedError):
                self._loop.add_writer(control.fileno(), self._flush)
                return
            except OSError:
                self._lose()
                return
            self._outbox.popleft()
            _close_all(descriptors)
        self._loop.remove_writer(control.fileno())

    def _receive(self) -> None:
        while self._control is not None:
            try:
                data, handles, _, _ = socket.recv_fds(self._control, CONTROL_MAX, 1)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                data, handles = b"", []
            if not data:
                self._lose()
                return
            self._handle(_decode(data), handles)

    def _handle(self, message: _Message, handles: list[int]) -> None:
        worker = self._workers.get(message.run)
        match message.event, worker:
            case "ready" | "unavailable", _ if self._ready.done():
                pass  # the caller stopped waiting just before
            case "ready", _:
                self.pid = message.pid
                self._ready.set_result(message.layers)
            case "unavailable", _:
                self._ready.set_exception(
                    SandboxUnavailable(f"programs cannot be locked in on this machine: {message.message}")
                )
            case "born", Worker():
                worker.pid = message.pid
                worker._take_handle(handles.pop())
                worker.born.set_result(None)
            case "refused", Worker():
                del self._workers[message.run]
                worker.born.set_exception(EngineError(f"no worker could be started: {message.message}"))
            case "stopped" | "continued", Worker():
                worker._set_stopped(message.event == "stopped")
            case "dead", Worker():
                del self._workers[message.run]
                worker._end(Death(message.status, message.cpu))
        _close_all(handles)

    def _lose(self) -> None:
        """Settle all workers of a zygote that has ended: the kernel has killed them, without further reports."""
        control, self._control = self._control, None
        if control is not None:
            self._loop.remove_reader(control.fileno())
            self._loop.remove_writer(control.fileno())
            control.close()
            self._on_lost(self)
        while self._outbox:
            _close_all(self._outbox.popleft()[1])
        workers, self._workers = self._workers, {}
        for worker in workers.values():
            worker._end(Death(None))
            if not worker.born.done():
                worker.born.set_exception(EngineError("the program zygote has ended"))
                worker.born.exception()  # the waiter may be gone
        if not self._ready.done():
            self._ready.set_exception(SandboxUnavailable("the program zygote ended before it was ready"))


def _start_process(descriptor: int, filter_required: bool) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, *_FLAGS, "-c", _BOOT, str(_HERE), str(descriptor), "filter" if filter_required else "-"],
        env=_ENVIRONMENT,
        cwd="/",
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        pass_fds=[descriptor],
        start_new_session=True,  # Ctrl-C at the terminal is for the server
    )


def _wait_process(process: subprocess.Popen[bytes]) -> None:
    try:
        process.wait(timeout=EXIT_MAX)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _close_all(descriptors: list[int]) -> None:
    for descriptor in descriptors:
        os.close(descriptor)
