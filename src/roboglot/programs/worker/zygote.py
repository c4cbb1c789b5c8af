"""The process that every program is forked from: clean, confined, single-threaded, with everything imported.

It reads spawn requests from its control socket, forks, and reports births, stops, continuations and deaths. It ends
when the socket ends, and the programs end with it. It knows no program's text and no robot.
"""

from __future__ import annotations

import codecs
import contextlib
import ctypes
import fcntl
import gc
import importlib
import json
import mmap
import os
import resource
import select
import signal
import socket
import sys
import time
from types import FrameType
from typing import Any

from roboglot.programs.worker import child, lockdown
from roboglot.programs.worker.frames import CONTROL_MAX
from roboglot.programs.worker.position import PositionMemory
from roboglot.programs.worker.seccomp import SOCKET_FD, SeccompUnavailable

_DESCRIPTORS = 2
_PROBE_CPU, _PROBE_MEMORY = 5, 64 * 1024 * 1024
_CODECS = ("ascii", "latin-1", "utf-16", "utf-32", "gbk", "gb18030", "cp1252", "unicode-escape", "raw-unicode-escape")
_PAGE = resource.getpagesize()


class Zygote:
    """The fork server's state: its control socket, the filter, and the run of each child."""

    def __init__(self, control: socket.socket, *, filter_required: bool) -> None:
        self._control, self._filter_required = control, filter_required
        self._libc = lockdown.open_libc()
        self._filter = self._find_filter()
        self._memory = os.open("/proc/self/statm", os.O_RDONLY)  # later reads are possible only through this descriptor
        self._runs: dict[int, int] = {}
        self._wake, wake = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        signal.signal(signal.SIGCHLD, _ignore)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)

    def confine(self) -> list[str]:
        """Lock the zygote down, then prove on a throw-away child that the filter holds. Raises OSError."""
        layers = lockdown.confine_zygote(self._libc)
        if self._filter:
            try:
                self._probe()
            except SeccompUnavailable:  # other errors do not concern the filter
                if self._filter_required:
                    raise
                self._filter = b""
        return [*layers, "seccomp"] if self._filter else layers

    def serve(self) -> None:
        """Serve until the control socket ends."""
        poll = select.poll()
        poll.register(self._control, select.POLLIN)
        poll.register(self._wake, select.POLLIN)
        while True:
            ready = {descriptor for descriptor, _ in poll.poll()}
            if self._wake in ready:
                os.read(self._wake, 4096)
                self._report_children()
            if self._control.fileno() in ready and not self._answer():
                return

    def end_programs(self) -> None:
        """Kill all programs: the kernel misses those that were stopped before their PR_SET_PDEATHSIG."""
        for pid in self._runs:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)

    def _find_filter(self) -> bytes:
        try:
            return lockdown.filter_code()
        except SeccompUnavailable:
            if self._filter_required:
                raise
            return b""

    def _answer(self) -> bool:
        message, descriptors, _, _ = socket.recv_fds(self._control, CONTROL_MAX, _DESCRIPTORS)
        if not message:
            return False
        request = json.loads(message)
        connection, memory = descriptors
        try:
            self._spawn(request, connection, memory)
        except OSError as error:
            self._send({"run": request["run"], "event": "refused", "message": str(error)})
        finally:
            os.close(connection)
            os.close(memory)
        return True

    def _spawn(self, request: dict[str, Any], connection: int, memory: int) -> None:
        quota = lockdown.Quota(request["memory"], request["cpu"])
        parent, used = os.getpid(), self._used()
        pid = os.fork()
        if pid == 0:
            self._become_program(parent, used, quota, connection, memory)
        self._runs[pid] = request["run"]
        descriptor = os.pidfd_open(pid)
        try:
            self._send({"run": request["run"], "event": "born", "pid": pid}, [descriptor])
        finally:
            os.close(descriptor)

    def _become_program(self, parent: int, used: int, quota: lockdown.Quota, connection: int, memory: int) -> None:
        """Become the program, in the child; never returns."""
        status = child.EXIT_BROKEN
        try:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            positions = PositionMemory(mmap.mmap(memory, 0))
            _keep_only(connection)
            lockdown.confine_program(self._libc, parent, used, quota, self._filter)
            status = child.main(SOCKET_FD, positions)
        finally:
            os._exit(status)

    def _report_children(self) -> None:
        while True:
            try:
                pid, status, usage = os.wait4(-1, os.WNOHANG | os.WUNTRACED | os.WCONTINUED)
            except ChildProcessError:
                return
            if pid == 0:
                return
            run = self._runs.get(pid)
            if run is None:
                continue
            if os.WIFSTOPPED(status):
                self._send({"run": run, "event": "stopped"})
            elif os.WIFCONTINUED(status):
                self._send({"run": run, "event": "continued"})
            else:
                del self._runs[pid]
                used = usage.ru_utime + usage.ru_stime
                self._send({"run": run, "event": "dead", "status": os.waitstatus_to_exitcode(status), "cpu": used})

    def _probe(self) -> None:
        """Probe the filter in a confined child. Raises SeccompUnavailable if the filter fails, OSError otherwise."""
        parent, used = os.getpid(), self._used()
        pid = os.fork()
        if pid == 0:
            status = child.EXIT_BROKEN
            try:
                signal.set_wakeup_fd(-1)
                lockdown.confine_program(
                    self._libc, parent, used, lockdown.Quota(_PROBE_MEMORY, _PROBE_CPU), self._filter
                )
                status = child.probe(PositionMemory(mmap.mmap(-1, mmap.PAGESIZE)))
            except OSError as error:
                status = min(error.errno or child.EXIT_BROKEN, 255)
            finally:
                os._exit(status)
        _, status = os.waitpid(pid, 0)
        code = os.waitstatus_to_exitcode(status)
        if code != 0:
            words = f"a system call filter cannot be used here (the test program ended with {code})"
            raise OSError(words) if code == child.EXIT_UNTOLD else SeccompUnavailable(words)

    def _used(self) -> int:
        return int(os.pread(self._memory, 256, 0).split()[0]) * _PAGE

    def _send(self, message: dict[str, object], descriptors: list[int] | None = None) -> None:
        socket.send_fds(self._control, [json.dumps(message).encode()], descriptors or [])


def _keep_only(connection: int) -> None:
    """Move the program's socket to its number and close everything else, standard streams included."""
    if connection != SOCKET_FD:
        os.dup2(connection, SOCKET_FD, inheritable=False)
    os.closerange(SOCKET_FD + 1, 1 << 20)
    os.closerange(0, SOCKET_FD)
    sys.stdin = sys.stdout = sys.stderr = None  # their descriptors are gone


def _import_ahead() -> None:
    """Import the modules that CPython itself imports for programs, as the jail allows no files."""
    for codec in _CODECS:
        codecs.lookup(codec)
    for module in ("_strptime", "unicodedata", "_pylong"):
        with contextlib.suppress(ImportError):  # _pylong came with Python 3.12
            importlib.import_module(module)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Do nothing; without a handler the wake-up descriptor is not written."""


def main(descriptor: int, *, filter_required: bool) -> None:
    """Serve on an inherited SEQPACKET socket. Without ``filter_required``, programs run even without a filter.

    The first message sent names the layers, or the reason why no program can be run.
    """
    control = socket.socket(fileno=descriptor)
    fcntl.fcntl(descriptor, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    _import_ahead()
    os.environ.clear()
    os.environ["TZ"] = "UTC0"
    time.tzset()
    try:
        zygote = Zygote(control, filter_required=filter_required)
        layers = zygote.confine()
    except (OSError, AttributeError, ctypes.ArgumentError) as error:
        control.send(json.dumps({"event": "unavailable", "message": str(error)}).encode())
        return
    child.rehearse()
    gc.freeze()
    gc.enable()
    try:
        control.send(json.dumps({"event": "ready", "pid": os.getpid(), "layers": layers}).encode())
        zygote.serve()
    except (BrokenPipeError, ConnectionResetError):
        return
    finally:
        zygote.end_programs()
