"""The process from which commands start warm: everything is imported, one thread, no event loop.

``python -m roboglot.cli.warm.parent SOCKET``: loads, then forks a command for each connection and reports its end.
One runs for each user and installation. It ends after ``IDLE`` s without commands, or when its sources have changed;
its commands end with it, and each with its connection, however they end.
"""

from __future__ import annotations

import ast
import contextlib
import ctypes
import fcntl
import importlib
import os
import resource
import select
import signal
import socket
import struct
import sys
import time
import types
from collections.abc import Callable
from typing import NoReturn, TypedDict

from roboglot.cli import built, run_to_end
from roboglot.cli import main as run_command
from roboglot.cli.warm.command import CODE, DESCRIPTORS_MAX, LENGTH, MESSAGE_MAX
from roboglot.hosting import installation
from roboglot.shards.warm_up import ENVIRONMENT, ended, fork, modules_of, wake_at_ends, warm

IDLE = 300.0  # s
SLOW_MAX = 2.0  # s for a caller to send its request
LAST_SECONDS = 3.0  # s between SIGTERM and SIGKILL for a command that has lost its caller
CALLERS_MAX = 64
COMMANDS = ("program", "test", "lesson")
MODULES = ("encodings.utf_8_sig", "typer._click.decorators", "typer.main", "typer.rich_utils")
PACKAGES = ("clients", "recording")  # beside those of all robots; not the test kit, whose modules pytest rewrites
PR_SET_NAME = 15
PEER = struct.Struct("3i")  # pid, uid, gid
OPEN_MAX = 1 << 16


class CommandRequest(TypedDict):
    """A command and everything that it inherits from its caller."""

    stamp: str
    kind: str
    words: list[str]
    descriptors: list[int]
    folder: str
    environment: dict[str, str]
    path: list[str]
    umask: int
    ignored: list[int]
    limits: list[tuple[int, int, int]]
    processors: list[int]


class WarmParent:
    """The listening socket and the running commands, each with its caller."""

    def __init__(self, path: str, lock: int, stamp: str) -> None:
        """Listen at ``path``; ``lock`` is held while we do; ``stamp`` is of the sources that were loaded."""
        self._path, self._lock, self._stamp = path, lock, stamp
        self._rights = installation.rights_of("self")
        self._callers: dict[int, tuple[int, socket.socket]] = {}  # by descriptor: process and connection
        self._ending: dict[int, float] = {}  # process and when it is killed, s
        self._wake = wake_at_ends()
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)  # of a killed one: we have the lock
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        listening.bind(path)
        listening.listen(CALLERS_MAX)
        self._listening: socket.socket | None = listening

    def serve(self) -> None:
        """Serve until there was nothing to do for ``IDLE`` s, or until the last command of old sources has ended."""
        poll = select.poll()
        poll.register(self._wake, select.POLLIN)
        if self._listening is not None:
            poll.register(self._listening, select.POLLIN)
        idle_since = time.monotonic()
        while self._listening is not None or self._callers or self._ending:
            busy = bool(self._callers or self._ending)
            ready = {descriptor for descriptor, _ in poll.poll(LAST_SECONDS * 1e3 if busy else IDLE * 1e3)}
            if ready or busy:
                idle_since = time.monotonic()
            elif time.monotonic() - idle_since >= IDLE:
                self._stop_listening()
                continue
            self._look_after(poll, ready)
            if self._listening is not None and self._listening.fileno() in ready:
                self._accept(poll)

    def _look_after(self, poll: select.poll, ready: set[int]) -> None:
        """Forward signals of the callers in ``ready`` to their commands; report commands that have ended."""
        with contextlib.suppress(BlockingIOError):
            os.read(self._wake, 4096)
        for descriptor in ready & self._callers.keys():
            if not self._forward_signals(descriptor):
                poll.unregister(descriptor)
                self._let_go(descriptor)
        for descriptor in self._reap():
            poll.unregister(descriptor)
            self._callers.pop(descriptor)[1].close()
        self._kill_late()

    def _accept(self, poll: select.poll) -> None:
        assert self._listening is not None
        caller, _ = self._listening.accept()
        descriptors: list[int] = []
        caller.settimeout(SLOW_MAX)
        try:
            wanted = self._read(caller, descriptors)
            if wanted["stamp"] != self._stamp:
                poll.unregister(self._listening)
                self._stop_listening()  # before the answer: the next one may start then
                caller.send(b"-")
            elif len(self._callers) < CALLERS_MAX:
                pid = self._fork(wanted, descriptors, caller)
                self._callers[caller.fileno()] = (pid, caller)
                poll.register(caller, select.POLLIN)
                return
        except (OSError, ValueError, KeyError, TypeError, SyntaxError, RecursionError, MemoryError) as error:
            sys.stderr.write(f"cannot start a command: {error}\n")
        finally:
            for descriptor in descriptors:
                os.close(descriptor)
        if caller.fileno() not in self._callers:
            caller.close()

    def _read(self, caller: socket.socket, descriptors: list[int]) -> CommandRequest:
        """Read a caller's request and descriptors. Raises OSError, ValueError."""
        credentials = caller.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, PEER.size)
        pid, uid, _ = PEER.unpack(credentials)
        if uid != os.getuid() or installation.rights_of(pid) != self._rights:
            raise PermissionError("the caller is another user, or in a sandbox")
        head, given, _, _ = socket.recv_fds(caller, LENGTH, DESCRIPTORS_MAX)
        descriptors += given
        length, text = int.from_bytes(head), b""
        if len(head) != LENGTH or length > MESSAGE_MAX:
            raise ValueError("this is not a request")
        while len(text) < length:
            if not (more := caller.recv(min(1 << 16, length - len(text)))):
                raise ValueError("the caller has gone")
            text += more
        wanted: CommandRequest = ast.literal_eval(text.decode())
        if wanted["descriptors"][:3] != [0, 1, 2] or len(given) != len(wanted["descriptors"]):
            raise ValueError("files are missing")
        return wanted

    def _fork(self, wanted: CommandRequest, descriptors: list[int], caller: socket.socket) -> int:
        def prepare() -> None:
            caller.send(b"+")  # first: if we are killed now, its caller must not start again
            take_signals(wanted)

        pid = fork(prepare)
        if pid == 0:
            ctypes.CDLL(None).prctl(PR_SET_NAME, b"roboglot", 0, 0, 0)
            os.setpgid(0, 0)  # in our session, so that the commands of one caller share its part of the processors
            become(wanted, descriptors, _run_code if wanted["kind"] == CODE else _run_command)
        return pid

    def _forward_signals(self, descriptor: int) -> bool:
        """Forward the caller's signals to its command; return False if the caller has gone."""
        pid, caller = self._callers[descriptor]
        try:
            numbers = caller.recv(64)
        except OSError:
            return False
        for number in numbers:
            _signal(pid, number)
        return bool(numbers)

    def _let_go(self, descriptor: int) -> None:
        """End a command whose caller has gone."""
        pid, caller = self._callers.pop(descriptor)
        caller.close()
        self._ending[pid] = time.monotonic() + LAST_SECONDS
        for number in (signal.SIGCONT, signal.SIGTERM):
            _signal(pid, number)

    def _kill_late(self) -> None:
        for pid, at in self._ending.items():
            if time.monotonic() >= at:
                _signal(pid, signal.SIGKILL)

    def _reap(self) -> list[int]:
        """Report what has ended; return the callers' descriptors."""
        statuses = dict(ended())
        for pid in statuses:
            self._ending.pop(pid, None)
        done = [descriptor for descriptor, (pid, _) in self._callers.items() if pid in statuses]
        for descriptor in done:
            pid, caller = self._callers[descriptor]
            with contextlib.suppress(OSError):
                caller.send(statuses[pid].to_bytes(LENGTH, signed=True))
        return done

    def _stop_listening(self) -> None:
        assert self._listening is not None
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._path)
        self._listening.close()
        self._listening = None
        os.close(self._lock)


def become(wanted: CommandRequest, descriptors: list[int], run: Callable[[list[str]], None]) -> NoReturn:
    """Turn the fork into the command with everything inherited from its caller, and call ``run``."""
    try:
        _take(descriptors, wanted["descriptors"])
        if signal.SIGINT not in wanted["ignored"]:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        for kind, soft, hard in wanted["limits"]:
            with contextlib.suppress(OSError, ValueError):  # a limit that we have lower ourselves
                resource.setrlimit(kind, (soft, hard))
        os.sched_setaffinity(0, wanted["processors"])
        os.umask(wanted["umask"])
        os.chdir(wanted["folder"])
        os.environ.clear()
        os.environ.update(wanted["environment"])
        time.tzset()
        sys.path[:] = wanted["path"]
        sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)  # a fork of a fork drops it, not the file
        sys.stdout = os.fdopen(1, "w", buffering=1, encoding="utf-8", closefd=False)
        sys.stderr = os.fdopen(2, "w", buffering=1, encoding="utf-8", errors="backslashreplace", closefd=False)
        run_to_end(lambda: run(wanted["words"]))
    except BaseException as error:  # noqa: BLE001 - a forked child has no caller to raise to
        sys.excepthook(*sys.exc_info())
        status = 130 if isinstance(error, KeyboardInterrupt) else 1
        run_to_end(lambda: sys.exit(status))


def take_signals(wanted: CommandRequest) -> None:
    """Ignore the signals that the caller ignores, and let the others end this process."""
    for number in signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP, signal.SIGPIPE, signal.SIGXFSZ}:
        with contextlib.suppress(OSError, ValueError):
            signal.signal(number, signal.SIG_IGN if number in wanted["ignored"] else signal.SIG_DFL)


def _take(descriptors: list[int], numbers: list[int]) -> None:
    """Move descriptors to the numbers (ascending) that they have in the caller, and close all others."""
    copies = [fcntl.fcntl(given, fcntl.F_DUPFD, numbers[-1] + 1) for given in descriptors]
    for copy, number in zip(copies, numbers, strict=True):
        os.dup2(copy, number)
    for number, following in zip(numbers, [*numbers[1:], min(os.sysconf("SC_OPEN_MAX"), OPEN_MAX)], strict=True):
        os.closerange(number + 1, following)


def _signal(pid: int, number: int) -> None:
    """Signal a command not reaped yet, whose pid is thus valid; its group, as a terminal would."""
    with contextlib.suppress(OSError, ValueError):
        if number == signal.SIGTERM:
            os.kill(pid, number)
            return
        try:
            os.killpg(pid, number)
        except ProcessLookupError:  # it has not begun yet
            os.kill(pid, number)


def _run_command(words: list[str]) -> None:
    sys.argv = [f"{installation.PACKAGE}/__main__.py", *words]
    run_command()


def _run_code(words: list[str]) -> None:
    """Do what ``python -c`` does."""
    code, *arguments = words
    sys.argv, sys.path[0] = ["-c", *arguments], ""
    package = sys.modules["roboglot"]  # a plugin of pytest's, which would warn that it is too late to rewrite it
    package.__doc__ = f"{package.__doc__} PYTEST_DONT_REWRITE"
    sys.modules["__main__"] = module = types.ModuleType("__main__")
    exec(compile(code, "<string>", "exec"), module.__dict__)


def main(path: str) -> None:
    """Load everything unless another parent is there or comes, then serve."""
    lock = os.open(f"{path}.lock", os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return
    for kind in (signal.SIGINT, signal.SIGHUP):
        signal.signal(kind, signal.SIG_IGN)
    stamp = installation.stamp()
    for name in (*MODULES, *modules_of(PACKAGES)):
        with contextlib.suppress(ModuleNotFoundError):  # of an extra that is not installed
            importlib.import_module(name)
    for name in COMMANDS:
        with contextlib.suppress(ModuleNotFoundError):
            built(name)
    warm()
    WarmParent(path, lock, stamp).serve()


if __name__ == "__main__":
    os.environ |= ENVIRONMENT  # before numpy is imported
    main(sys.argv[1])
