"""Imports and kernels that a shard needs, loaded before the first fork, without starting a thread; and the fork."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import os
import pkgutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from types import FrameType
from typing import NoReturn

PACKAGES = ("runtime", "simulation", "autonomy", "storage", "protocols", "programs", "console", "access", "transport")
SELDOM = (  # modules that few shards need, or that are programs of their own
    "roboglot.programs.worker",
    "roboglot.protocols.cyberdog.app_link",
    "roboglot.storage.postgresql",
)
FOREIGN = (
    "_strptime",
    "cryptography.hazmat.backends.openssl.backend",
    "encodings.idna",
    "grpc._utilities",
    "grpc.aio",
    "mujoco",
    "numpy.ma",
    "unicodedata",
    "uvicorn.lifespan.off",
    "uvicorn.protocols.http.auto",
    "uvicorn.protocols.http.httptools_impl",
    "uvicorn.protocols.websockets.wsproto_impl",
    "uvloop",
    "websockets.asyncio.client",
    "websockets.extensions.permessage_deflate",
    "websockets.proxy",
    "websockets.server",
    "wsproto",
)
ENVIRONMENT = {  # of the nursery: keeps libraries from starting threads, and gRPC from handling forks
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "GRPC_VERBOSITY": "NONE",
    "GRPC_ENABLE_FORK_SUPPORT": "0",
}
TASKS = "/proc/self/task"
PR_SET_PDEATHSIG = 1
EXIT_BROKEN = 70  # of a child that could not begin, or whose work failed


class Threaded(RuntimeError):
    """An import started a thread in the process that must be able to fork."""


def warm() -> None:
    """Load everything, then freeze it, so that garbage collection copies no shared pages. Raises Threaded."""
    _compile()
    gc.disable()
    for name in modules_of(PACKAGES):
        try:
            importlib.import_module(name)
        except ModuleNotFoundError as missing:  # the extra is not installed; code that needs it reports that
            if (missing.name or "").startswith("roboglot"):
                raise
    for name in FOREIGN:
        importlib.import_module(name)
    from roboglot.kernels import MODULES, loading
    from roboglot.values import make_initialisers

    with loading():
        for name in MODULES:
            importlib.import_module(f"roboglot.kernels.{name}")
    _rehearse()
    make_initialisers()
    gc.freeze()  # with the garbage: finding its few thousand objects would take a tenth of the time
    gc.enable()
    refuse_threads()


def _compile() -> None:
    """Compile missing kernels in a separate process: here, a compiler would leave 400 MB to every fork."""
    from roboglot.kernels.ahead import missing

    if missing():
        command = [sys.executable, "-m", "roboglot.kernels"]
        subprocess.run(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, check=False)  # else they are compiled here


def _rehearse() -> None:
    """Build a world and tables once, so that every fork inherits the caches of decoders, parts, physics and schemas."""
    from roboglot.model.clock import LockstepClock
    from roboglot.model.robot import Robot
    from roboglot.shards.shard import settings_of
    from roboglot.simulation.world.world import RobotPlacement, World
    from roboglot.simulation.world.world_files import load_world
    from roboglot.storage.database import newest_tables

    config, clock = settings_of({}), LockstepClock()
    name = config.robots[0].name
    world = World(load_world(config.world), [RobotPlacement(name)], clock=clock)
    world.equip(Robot(name, world.description_of(name), clock))
    world.close()
    newest_tables()


def refuse_threads() -> None:
    """Raise Threaded if this process has more than one thread: a fork would copy their locks and not the threads."""
    if os.path.isdir(TASKS) and len(os.listdir(TASKS)) > 1:
        raise Threaded(f"a module started a thread when it was imported; {len(os.listdir(TASKS))} run")


def fork(prepare: Callable[[], None]) -> int:
    """Fork; return 0 in the child, which is killed when this process ends. Raises Threaded.

    The child calls ``prepare`` while its signals are blocked: one that is sent meanwhile meets the handlers that
    ``prepare`` sets, not those of this process. If ``prepare`` fails, the child ends.
    """
    refuse_threads()
    parent, heard = os.getpid(), signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    try:
        if (pid := os.fork()) == 0:
            _begin(parent, prepare)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)
    return pid


def _begin(parent: int, prepare: Callable[[], None]) -> None:
    """Prepare a forked child, or end it."""
    try:
        signal.set_wakeup_fd(-1)
        end_with(parent)
        prepare()
    except BaseException:  # noqa: BLE001 - the caller's handlers are the parent's, which this process must not become
        sys.excepthook(*sys.exc_info())
        os._exit(EXIT_BROKEN)


def become(work: Callable[[], int]) -> NoReturn:
    """Do the work of a forked child, which has no caller to raise to, and end it with the work's status."""
    status = EXIT_BROKEN
    try:
        status = work()
    except BaseException:  # noqa: BLE001 - see above
        sys.excepthook(*sys.exc_info())
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stderr.flush()
        os._exit(status)


def end_with(parent: int) -> None:
    """Have the kernel kill this process when its parent ends, for any reason."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it died before that was set
        os._exit(EXIT_BROKEN)


def wake_at_ends() -> int:
    """Return a descriptor that can be read when a child has ended."""
    wake, end = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.signal(signal.SIGCHLD, _ignore)
    signal.set_wakeup_fd(end, warn_on_full_buffer=False)
    return wake


def ended() -> Iterator[tuple[int, int]]:
    """Yield the children that have ended, and their exit status, negative for a signal."""
    with contextlib.suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0]:
            yield found[0], os.waitstatus_to_exitcode(found[1])


def _ignore(number: int, frame: FrameType | None) -> None:
    """Do nothing: without a handler, nothing would be written to the wake-up descriptor."""


def modules_of(packages: Iterable[str]) -> Iterator[str]:
    """Import packages of roboglot; return the names of their modules as well that are not imported yet."""
    for package in packages:
        name = f"roboglot.{package}"
        yield name
        for path in getattr(importlib.import_module(name), "__path__", ()):
            for found in pkgutil.walk_packages([path], f"{name}."):
                if found.name not in sys.modules and not _is_seldom(found.name):
                    yield found.name


def _is_seldom(name: str) -> bool:
    return name.endswith("__main__") or any(name == own or name.startswith(f"{own}.") for own in SELDOM)
