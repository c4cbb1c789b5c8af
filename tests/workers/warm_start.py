"""``python -m roboglot …``, and xdist's workers, forked from a process that has imported everything.

``install`` has ``subprocess.Popen``, and with it asyncio and execnet, start such commands like this, in a tenth of the
processor time. The process is a child of ours as if we had started it ourselves: output, signals, exit status and
waiting are the same. So do ``python -m pytest``, ``python -m tests.…``, and ``python -c`` with a program whose first
line is ``# warm``; and zygotes of visual programs, each from a process that has loaded what they load
(``tests/programs/zygote_bed.py``). Commands with an environment for another interpreter, and all other programs, start
cold; so do those with ``ROBOGLOT_TESTS_COLD=1`` in theirs. A worker is born with a process that forks of its own.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import inspect
import json
import os
import pkgutil
import runpy
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

from execnet.gateway_io import popen_bootstrapline

from roboglot.cli.warm.command import surroundings
from roboglot.shards.warm_up import end_with, fork
from tests.programs import zygote_bed

COLD = "ROBOGLOT_TESTS_COLD"
WORKER = [sys.executable, "-u", "-c", popen_bootstrapline]
PLAIN = {
    "shell": False,
    "preexec_fn": None,
    "close_fds": True,
    "restore_signals": True,
    "gid": None,
    "gids": None,
    "uid": None,
    "umask": -1,
    "process_group": -1,
}
OF_THE_INTERPRETER = ("PYTHON", "LC_", "LANG", "NUMBA_", "OPENBLAS_", "OMP_", "MKL_", "GRPC_", "LD_", "MALLOC_")
ZYGOTE = "from roboglot.programs.worker import zygote\nzygote.main("  # in its code
PR_SET_CHILD_SUBREAPER = 36
PATIENCE = 120.0  # real s for a child; the first one waits for all imports

SOURCES = str(Path(__file__).parents[2] / "src")
ZYGOTES = {"PYTHONHASHSEED": "0"}  # the environment

_execute_cold: Any = subprocess.Popen._execute_child  # type: ignore[attr-defined]
_signature = inspect.signature(_execute_cold)


class WarmParent:
    """Process that forks, started at the first use. ``line``: a socket to one that runs already."""

    def __init__(self, line: socket.socket | None = None) -> None:
        self._lock = threading.Lock()
        self._line = line
        self._libc = ctypes.CDLL(None, use_errno=True)

    def start(self, wish: dict[str, Any], descriptors: list[int]) -> int:
        """Return the process id of a new child. Raises OSError."""
        with self._lock:
            line = self._line or self._open()
            line.settimeout(PATIENCE)
            self._line = None  # after a failure, the next child comes from another process
            self._libc.prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)  # its parent ends at once: we adopt it
            try:
                socket.send_fds(line, [json.dumps(wish).encode()], descriptors)
                answer = line.recv(64)
            finally:
                self._libc.prctl(PR_SET_CHILD_SUBREAPER, 0, 0, 0, 0)
            if not answer:
                raise OSError("the process that forks has died")
            self._line = line
        return int(answer)

    def _open(self) -> socket.socket:
        from roboglot.shards.warm_up import ENVIRONMENT

        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with its:
            subprocess.Popen(
                [sys.executable, "-m", __name__, str(its.fileno())],
                pass_fds=[its.fileno()],
                stdin=subprocess.DEVNULL,
                cwd=Path(__file__).parents[2],
                # Forks have a hash seed other than ours: a rerun of what we recorded must not depend on it.
                env={**os.environ, **ENVIRONMENT, "PYTHONHASHSEED": "random"},
            ).returncode = 0  # it ends with our socket; no need to wait for it
        return ours


_parent = WarmParent()


def install() -> None:
    """Start ``python -m roboglot`` warm from now on."""
    if sys.platform == "linux":
        subprocess.Popen._execute_child = _execute  # type: ignore[attr-defined]


def _execute(process: Any, *arguments: Any, **named: Any) -> None:
    """Start a process in place of ``Popen._execute_child``, with its arguments."""
    wanted = _signature.bind(process, *arguments, **named).arguments
    zygote = _is_zygote(wanted)
    if not zygote and not _is_warm(wanted):
        _execute_cold(process, *arguments, **named)
        return
    ends = [wanted[name] for name in ("p2cread", "p2cwrite", "c2pread", "c2pwrite", "errread", "errwrite")]
    given = [end if end != -1 else own for own, end in enumerate((ends[0], ends[3], ends[5]))]
    wish = surroundings() | {
        "words": [str(os.fspath(word)) for word in wanted["args"][1:]],
        "folder": str(wanted["cwd"] or Path.cwd()),
        "environment": dict(os.environ if wanted["env"] is None else wanted["env"]),
        "descriptors": [0, 1, 2, *wanted["pass_fds"]],
        "session": bool(wanted["start_new_session"]),
        "parent": os.getpid(),
        "zygote": zygote,
    }
    try:
        process.pid = _parent.start(wish, [*given, *wanted["pass_fds"]])
        process._child_created = True
    finally:
        process._close_pipe_fds(*ends)


def _is_warm(wanted: Mapping[str, Any]) -> bool:
    words = wanted["args"]
    words = [words] if isinstance(words, str | bytes | os.PathLike) else list(words)
    if not _is_ours(words):
        return False
    if wanted["pass_fds"] or any(wanted.get(name, usual) != usual for name, usual in PLAIN.items()):
        return False
    environment = os.environ if wanted["env"] is None else wanted["env"]
    return COLD not in environment and _of_the_interpreter(environment) == _of_the_interpreter(os.environ)


def _is_zygote(wanted: Mapping[str, Any]) -> bool:
    """True for a zygote that nothing keeps from starting warm."""
    match wanted["args"]:
        case [sys.executable, "-s", "-S", "-P", "-c", str(code), str(path), _, _] if path == SOURCES and ZYGOTE in code:
            unusual = any(wanted.get(name, usual) != usual for name, usual in PLAIN.items())
            return COLD not in os.environ and wanted["env"] == ZYGOTES and not unusual
    return False


def _is_ours(words: list[Any]) -> bool:
    """True if the command needs the modules that the forking process has loaded."""
    match words:
        case [sys.executable, "-m", str(module), *_]:
            return module in ("roboglot", "pytest") or module.startswith("tests.")
        case [sys.executable, "-c", str(code), *_]:
            return code.lstrip().startswith("# warm\n")
    return words == WORKER


def _of_the_interpreter(environment: Mapping[Any, Any]) -> dict[Any, Any]:
    return {name: value for name, value in environment.items() if str(name).startswith(OF_THE_INTERPRETER)}


# -- the process that forks --------------------------------------------------------------------------------------------


def serve(line: socket.socket) -> None:
    """Fork a process for each message until the other end closes."""
    bed: socket.socket | None = None
    while True:
        message, descriptors = zygote_bed.receive(line)
        if not message:
            return
        wish = json.loads(message)
        if wish["zygote"]:
            bed = bed or _make_bed()
            socket.send_fds(bed, [message], descriptors)
            answer = bed.recv(64)
        else:
            answer = zygote_bed.born(partial(_become, wish, descriptors), partial(fork, partial(_take_signals, wish)))
        line.send(answer)
        for descriptor in descriptors:
            os.close(descriptor)


def _make_bed() -> socket.socket:
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with its:
        command = [sys.executable, "-s", "-S", "-P", zygote_bed.__file__, SOURCES, str(its.fileno())]
        subprocess.Popen(command, env=ZYGOTES, stdin=subprocess.DEVNULL, pass_fds=[its.fileno()]).returncode = 0
    return ours


def _take_signals(wish: Any) -> None:
    from roboglot.cli.warm.parent import take_signals

    take_signals(wish)


def _become(wish: Any, descriptors: list[int]) -> NoReturn:
    """Become the requested process; called in the fork."""
    from roboglot.cli.warm.parent import become

    end_with(wish["parent"])
    if wish["session"]:
        os.setsid()
    wish["path"] = sys.path
    become(wish, descriptors, lambda words: _run(words, wish["folder"]))


def _run(words: list[str], folder: str) -> None:
    """Run the words of a command line that follow Python's own name."""
    match words:
        case ["-m", "roboglot", *arguments]:
            package = importlib.import_module("roboglot")
            sys.argv = [str(Path(str(package.__file__)).with_name("__main__.py")), *arguments]
            sys.path[0] = folder
            from roboglot.cli import main as run_command

            run_command()
        case ["-m", module, *arguments]:
            if module == "pytest":
                _leave_to_pytest()
            sys.argv, sys.path[0] = [module, *arguments], folder
            runpy.run_module(module, run_name="__main__", alter_sys=True)
        case ["-c", code, *arguments]:
            sys.argv, sys.path[0] = ["-c", *arguments], ""
            exec(compile(code, "<string>", "exec"), _new_main())
        case _:
            _work()


def _new_main() -> dict[str, Any]:
    """Return the names of a new main module."""
    sys.modules["__main__"] = made = ModuleType("__main__")
    return made.__dict__


OF_TESTS = (
    "aiortc",
    "av",
    "cv2",
    "httpx",
    "playwright.async_api",
    "psycopg",
    "rosbags.highlevel",
    "ruamel.yaml",
)
REWRITTEN = ("roboglot.cli.", "roboglot.demo.", "roboglot.testing.")  # by pytest, and what imports that


def _work() -> None:
    """Be a worker of xdist, as if Python had just been started for it."""
    global _parent
    gc.disable()  # conftest.py enables it when all tests are collected
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    if os.fork() == 0:
        ours.close()
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        nothing = os.open(os.devnull, os.O_RDWR)
        for pipe in (0, 1):  # the worker's alone: they end with it
            os.dup2(nothing, pipe)
        serve(its)
        os._exit(0)
    its.close()
    _parent = WarmParent(ours)
    _leave_to_pytest()
    sys.argv, sys.path[0] = ["-c"], ""
    exec(eval(sys.stdin.readline()), _new_main())


def _leave_to_pytest() -> None:
    """Forget the modules whose assertions pytest rewrites."""
    for name in [name for name in sys.modules if f"{name}.".startswith(REWRITTEN)]:
        del sys.modules[name]
    for name in ("roboglot", "tests"):  # else pytest warns that they are imported already
        package = importlib.import_module(name)
        package.__doc__ = f"{package.__doc__}\nPYTEST_DONT_REWRITE"


def main(descriptor: int) -> None:
    """Load everything, then serve."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from roboglot import cli
    from roboglot.cli.warm.parent import MODULES
    from roboglot.shards.warm_up import ENVIRONMENT, refuse_threads, warm

    for module in pkgutil.walk_packages(cli.__path__, f"{cli.__name__}."):
        importlib.import_module(module.name)
    for command in cli.COMMANDS:
        cli.built(command)
    for name in (*MODULES, *OF_TESTS):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    warm()
    refuse_threads()
    for name in ENVIRONMENT:
        os.environ.pop(name, None)
    serve(socket.socket(fileno=descriptor))


if __name__ == "__main__":
    importlib.import_module("tests.workers.warm_start").main(int(sys.argv[1]))  # the module that a worker imports
