"""The server is killed with workers suspended before their first step: none of them stays."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from roboglot.testing.process import child
from tests.programs.playing import process_state

WORKERS = 12
SERVER = f"""
# warm
import asyncio, signal
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.launcher import Launcher

async def spawn(self, *args, **kwargs):
    # Stopped as soon as its number is known: most have not asked the kernel yet to end with their parent.
    worker = await born(self, *args, **kwargs)
    worker.signal(signal.SIGSTOP)
    return worker

born, Launcher.spawn = Launcher.spawn, spawn

async def main():
    engine = Engine()
    await engine.open()
    runs = await asyncio.gather(*(engine.start("while True: pass") for _ in range({WORKERS})))
    print(*(run.pid for run in runs), flush=True)
    await asyncio.Event().wait()

asyncio.run(main())
"""


def test_no_suspended_worker_outlives_its_server() -> None:
    with child(SERVER) as server:
        assert server.stdout
        workers = [int(word) for word in server.stdout.readline().split()]
        assert len(workers) == WORKERS
        server.kill()
    deadline = time.monotonic() + 60
    while (left := [pid for pid in workers if process_state(pid) not in ("", "Z")]) and time.monotonic() < deadline:
        time.sleep(0.01)
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert not left


def test_the_test_suspends_them_early_enough() -> None:
    """At least one is stopped before it had confined itself, or the test above would prove nothing."""
    with child(SERVER) as server:
        assert server.stdout
        workers = server.stdout.readline().split()
        early = [
            pid for pid in workers if "\nNoNewPrivs:\t1\nSeccomp:\t2\n" not in Path(f"/proc/{pid}/status").read_text()
        ]
        server.kill()
    assert early
