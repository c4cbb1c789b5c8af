"""The zygote's start: who is called off in the middle of it leaves no process behind."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from typing import Any

import pytest

from roboglot.programs.engine import launcher
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.launcher import Launcher
from tests.workers.warm_start import COLD, SOURCES

# What a zygote starts with, in place of what it would do. socket.recv_fds, by which the warm one is asked, imports
# array; a newer libffi keeps its own file open, and the warm one has closed it.
REPORT = """
import array, gc, json, os, signal, sys, threading
gc.disable()
sys.path.insert(0, sys.argv[1])
from roboglot.programs.worker import zygote

def report(*given, **named):
    zygote._import_ahead()
    os.umask(umask := os.umask(0))
    print(json.dumps({
        "modules": sorted(sys.modules), "given": [given, named], "words": sys.argv[:-2], "path": sys.path,
        "environment": dict(os.environ), "folder": os.getcwd(), "umask": umask, "collects": gc.isenabled(),
        "leads": os.getsid(0) == os.getpid(), "flags": list(sys.flags), "threads": threading.active_count(),
        "names": sorted(name for name in globals() if "__" not in name),
        "order": list(set("these have an order".split())),
        "ignored": [n for n in range(1, 32) if signal.getsignal(n) == signal.SIG_IGN],
        "descriptors": [n for n in range(100) if os.path.exists(link := f"/proc/self/fd/{n}")
            and "/libffi.so" not in os.readlink(link)],
    }), flush=True)

zygote.main = report
sys.path.remove(sys.argv[1])
"""


@pytest.mark.parametrize("times", [1, 2])
async def test_cancelled_start_leaves_nothing(monkeypatch: pytest.MonkeyPatch, times: int) -> None:
    begin, started = launcher._start_process, list[subprocess.Popen[bytes]]()

    def slowly(descriptor: int, filter_required: bool) -> subprocess.Popen[bytes]:
        time.sleep(0.1)
        started.append(begin(descriptor, filter_required))
        return started[0]

    monkeypatch.setattr(launcher, "_start_process", slowly)
    opening = asyncio.create_task(Launcher(lambda _lost: None).open())
    for _ in range(times):
        await asyncio.sleep(0.02)
        opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    assert [process.returncode is not None for process in started] == [True]


async def test_engine_that_still_starts_closes_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    started, loop, begun = list[subprocess.Popen[bytes]](), asyncio.get_running_loop(), asyncio.Event()

    def never_ready(descriptor: int, filter_required: bool) -> subprocess.Popen[bytes]:
        started.append(subprocess.Popen([sys.executable, "-c", "import signal; signal.pause()"], pass_fds=[descriptor]))
        loop.call_soon_threadsafe(begun.set)
        return started[0]

    monkeypatch.setattr(launcher, "_start_process", never_ready)
    monkeypatch.setattr(launcher, "EXIT_MAX", 600.0)
    engine = Engine()
    engine.open_soon()
    await begun.wait()
    async with asyncio.timeout(60):
        await engine.close()
    assert started[0].returncode == -signal.SIGKILL


@pytest.mark.parametrize("event", ["ready", "unavailable"])
async def test_zygote_that_is_ready_too_late_is_ignored(event: str) -> None:
    """Its message was read in the turn of the loop in which its caller stopped waiting."""
    late = Launcher(lambda _lost: None)
    late._ready = asyncio.get_running_loop().create_future()
    late._ready.cancel()
    late._handle(launcher._decode(json.dumps({"event": event})), [])
    assert late.pid == 0


def test_tests_own_zygotes_begin_as_cold_ones_do(monkeypatch: pytest.MonkeyPatch) -> None:
    reading, writing = os.pipe()
    with open(reading, "rb"), open(writing, "wb"):
        words = [sys.executable, *launcher._FLAGS, "-c", REPORT + launcher._BOOT, SOURCES, str(writing), "filter"]

        def start() -> Any:
            done = subprocess.run(
                words,
                env=launcher._ENVIRONMENT,
                cwd="/",
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                pass_fds=[writing],
                start_new_session=True,
                check=True,
            )
            return json.loads(done.stdout)

        warm = start()
        monkeypatch.setenv(COLD, "1")
        assert warm == start()
