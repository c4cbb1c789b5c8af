"""Ahead-of-time compilation of kernels into Numba's cache on disk, on all cores, with marks for compiled ones.

Imports no Numba.

A kernel counts as compiled when a mark beside the cache carries the fingerprint of its source, of the kernels that are
built into it, of Numba and of this machine's processor: a cache from another version or another processor is compiled
anew, with progress, not in silence.
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import hashlib
import os
import queue
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from weakref import WeakKeyDictionary

from roboglot.kernels import MODULES

LLVM_LEVEL = "1"  # optimisation level: 3 takes a sixth longer and gains nothing
WORKERS_MAX = 4  # parallel compilers; each needs up to 350 MB
HERE = Path(__file__).parent
_turns: WeakKeyDictionary[asyncio.AbstractEventLoop, asyncio.Lock] = WeakKeyDictionary()
Report = Callable[[str, int, int], None]  # name of the finished kernel, number finished, total


class KernelsUnavailable(RuntimeError):
    """The kernels cannot be compiled or kept; the message is a sentence for people."""


def missing(modules: Sequence[str] = MODULES) -> list[str]:
    """Return those of ``modules`` that are not compiled for this source, this Numba and this processor."""
    return _missing(cache_folder(), modules)


def _missing(folder: Path, modules: Sequence[str]) -> list[str]:
    stat = cache(os.stat)  # most modules are built from the same few files
    return [name for name in modules if not os.path.exists(f"{folder}/{_mark(name, stat)}")]


def compile_ahead(modules: Sequence[str] = MODULES, report: Report = lambda _name, _done, _total: None) -> None:
    """Compile those of ``modules`` that are missing, in separate processes; return when all are ready.

    Waits for another process that compiles already. Raises KernelsUnavailable.
    """
    if not missing(modules):
        return
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with _alone(folder):
            names = missing(modules)
            _forget(names)
            for done, name in enumerate(_compiled(names), start=1):
                (folder / _mark(name)).touch()
                report(name, done, len(names))
    except OSError as error:
        raise KernelsUnavailable(
            f"{folder} cannot hold compiled kernels: {error.strerror or error}; NUMBA_CACHE_DIR chooses another folder"
        ) from None


async def compile_beside(modules: Sequence[str] = MODULES, report: Report = lambda _name, _done, _total: None) -> None:
    """Do what ``compile_ahead`` does without holding the event loop or a thread; ends at once when cancelled.

    All robots of a program share one compiler: those that come later wait for the first, whose progress is reported.
    """
    if not missing(modules):
        return
    async with _turns.setdefault(asyncio.get_running_loop(), asyncio.Lock()):
        if missing(modules):
            await _compile_apart(modules, report)


async def _compile_apart(modules: Sequence[str], report: Report) -> None:
    """Compile in a separate process; it and its compilers are killed when this is cancelled."""
    pipe = asyncio.subprocess.PIPE
    command = (sys.executable, "-m", "roboglot.kernels", *modules)
    process = await asyncio.create_subprocess_exec(*command, stdout=pipe, stderr=pipe, start_new_session=True)
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        async for line in process.stdout:
            if found := re.match(rb"\[(\d+)/(\d+)\] (\w+)", line):
                report(found[3].decode(), int(found[1]), int(found[2]))
        words = (await process.stderr.read()).decode("utf-8", "replace").strip().splitlines()
        if await process.wait():
            raise KernelsUnavailable(words[-1] if words else "the compiler was killed")
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


@cache
def cache_folder() -> Path:
    """Return Numba's cache folder: its own setting, a folder beside the sources, or the user's cache folder.

    One beside the sources that cannot be written is taken if it has all kernels, as where an administrator installed.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    beside = HERE / "__pycache__"
    if os.access(beside if beside.exists() else HERE, os.W_OK) or not _missing(beside, MODULES):
        return beside
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "numba"


def _forget(names: Sequence[str]) -> None:
    """Remove Numba's cache of ``names``: it checks only a kernel's own file, not those that it is built from.

    The caches of other Pythons stay: each has marks of its own.
    """
    beside, apart = HERE / "__pycache__", f"{HERE.name}_{hashlib.sha1(str(HERE).encode()).hexdigest()}"
    folder, python = cache_folder(), f"py{sys.version_info.major}{sys.version_info.minor}"
    for name in names:
        for old in (folder if folder == beside else folder / apart).glob(f"{name}.*.{python}*nb[ci]"):
            old.unlink(missing_ok=True)


def _mark(name: str, stat: Callable[[str], os.stat_result] = os.stat) -> str:
    stats = [stat(f"{HERE}/{source}.py") for source in _sources(name)]  # every start asks for all of them
    text = f"{_machine()} {HERE} {[(stat.st_mtime_ns, stat.st_size) for stat in stats]}"
    return f"roboglot-{name}.{hashlib.sha256(text.encode()).hexdigest()[:16]}.compiled"


@cache
def _sources(name: str) -> tuple[str, ...]:
    """Return the modules that become part of the compiled module ``name``: itself and all its imports."""
    found = [name]
    for source in found:
        text = (HERE / f"{source}.py").read_text("utf-8")
        found += sorted(set(re.findall(r"^from roboglot\.kernels\.(\w+) import", text, re.MULTILINE)) - {*found})
    return tuple(found)


@cache
def _machine() -> str:
    """Return a description of Numba and the processor, on which compiled code depends besides its source."""
    from importlib.metadata import PackageNotFoundError, version  # slow to load, and not needed before doors open

    versions = []
    for package in ("numba", "llvmlite", "numpy"):
        with contextlib.suppress(PackageNotFoundError):
            versions.append(version(package))
    processor = os.uname().machine
    if chosen := os.environ.get("NUMBA_CPU_NAME"):  # compiled for that processor, wherever this runs
        return f"{sys.version_info} {versions} {processor} {chosen} {os.environ.get('NUMBA_CPU_FEATURES')}"
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines():
            if line.startswith(("model name", "flags", "Features")):
                processor += line
            elif not line:
                break
    return f"{sys.version_info} {versions} {processor}"


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Hold the folder's lock, which ends with the process."""
    with (folder / "roboglot.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _compiled(names: Sequence[str]) -> Iterator[str]:
    """Yield each of ``names`` as it is compiled; raises KernelsUnavailable with a compiler's last words."""
    waiting: queue.SimpleQueue[str] = queue.SimpleQueue()
    finished: queue.SimpleQueue[str | KernelsUnavailable] = queue.SimpleQueue()
    for name in sorted(names, key=MODULES.index):
        waiting.put(name)
    compilers = [_start_compiler() for _ in range(min(WORKERS_MAX, os.cpu_count() or 1, len(names)))]
    threads = [threading.Thread(target=_feed, args=(c, waiting, finished), daemon=True) for c in compilers]
    try:
        for thread in threads:
            thread.start()
        for _ in names:
            result = finished.get()
            if isinstance(result, KernelsUnavailable):
                raise result
            yield result
    finally:
        for compiler in compilers:
            compiler.kill()
            compiler.wait()
        for thread in threads:
            thread.join()
        for compiler in compilers:
            for pipe in (compiler.stdin, compiler.stdout, compiler.stderr):
                if pipe is not None:
                    pipe.close()


def _start_compiler() -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "roboglot.kernels", "--compiler"]
    pipe, level = subprocess.PIPE, os.environ.get("NUMBA_OPT", LLVM_LEVEL)
    environment = os.environ | {"NUMBA_OPT": level}
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, bufsize=1, env=environment)


def _feed(
    compiler: subprocess.Popen[str],
    waiting: queue.SimpleQueue[str],
    finished: queue.SimpleQueue[str | KernelsUnavailable],
) -> None:
    """Pass kernels to one compiler, one after the other."""
    assert compiler.stdin is not None
    assert compiler.stdout is not None
    assert compiler.stderr is not None
    while not waiting.empty():
        try:
            name = waiting.get_nowait()
        except queue.Empty:
            return
        try:
            compiler.stdin.write(f"{name}\n")
            answer = compiler.stdout.readline().strip()
        except (OSError, ValueError):  # killed because another one failed
            answer = ""
        if answer != name:
            with contextlib.suppress(ValueError, OSError):
                answer = (compiler.stderr.read().strip().splitlines() or [answer or "the compiler was killed"])[-1]
            finished.put(KernelsUnavailable(f"kernel {name} does not compile: {answer}"))
            return
        finished.put(name)
