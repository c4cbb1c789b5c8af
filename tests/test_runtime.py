"""The runtime: doors go away when their robot switches off, and come back with it."""

from __future__ import annotations

import asyncio
import dataclasses
import gc
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from roboglot.config import Config, RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.power import Power
from roboglot.model.components.system.settings import Settings
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(1)
PORTS = (1448, 40923, 50052)
LATER = (  # what a start need not load: clients come later, files may be old, doors closed
    "PIL av cryptography numba rich uvicorn yaml websockets roboglot.access.guard roboglot.console.application"
    " roboglot.console.studio.lessons roboglot.protocols.foxglove.dispatch roboglot.protocols.ros2.server"
    " roboglot.protocols.vda5050.server roboglot.recording.recorder statistics webbrowser importlib.resources"
    " google.protobuf.descriptor_pb2"
)
OPENED = f"""
import asyncio, sys
import roboglot.cli.up
from roboglot.config import load_config
from roboglot.runtime import Runtime

async def start():
    built = Runtime(load_config(None, {{"data": sys.argv[1], "world": "empty"}}))
    print(sorted(set({LATER.split()}) & sys.modules.keys()))
    await built.close()

asyncio.run(start())
"""
CONNECTED = """
import sys
from roboglot.extras import open_uvicorn
open_uvicorn()
import uvicorn.lifespan.off, uvicorn.protocols.http.httptools_impl, uvicorn.protocols.websockets.wsproto_impl
from uvicorn.server import ServerState
open_uvicorn()
print({"click", "multiprocessing", "uvicorn.main"} & sys.modules.keys())
assert uvicorn.Config is uvicorn.config.Config
from uvicorn import Server, run
assert Server is sys.modules["uvicorn.server"].Server and uvicorn.run is run and uvicorn.Config is uvicorn.config.Config
"""


def config(data: Path) -> Config:
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    return dataclasses.replace(base, robots=(RobotConfig("a", "universal", ADDRESS),))


def answers(port: int) -> bool:
    try:
        socket.create_connection((ADDRESS, port), timeout=60).close()
    except OSError:
        return False
    return True


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(60):
        while not await asyncio.to_thread(condition):  # noqa: ASYNC110 - sockets have no event
            await asyncio.sleep(0.05)


async def test_no_lockstep_time_passes_while_the_disk_works(tmp_path: Path) -> None:
    started = Runtime(config(tmp_path / "data"))
    clock = started.clock
    assert isinstance(clock, LockstepClock)
    settings, written = started.fleet.robots["a"][Settings], list[float]()

    async def keep(number: int) -> None:
        await clock.sleep(0.1 * number)
        await settings.put("number", number)
        written.append(clock.time())

    keeping = [asyncio.create_task(keep(number)) for number in range(10)]
    await clock.advance(5.0)
    assert written == [0.1 * number for number in range(10)]
    assert all(task.done() for task in keeping)
    await started.close()


async def test_failed_start_leaves_its_folder_free(tmp_path: Path) -> None:
    """In a process that goes on: a test, a notebook, a shard's next try."""
    right = config(tmp_path / "data")
    await Runtime(right).close()
    gc.collect()
    before = set(os.listdir("/proc/self/fd"))
    with pytest.raises((ValueError, OSError), match="nowhere"):
        Runtime(dataclasses.replace(right, world="nowhere"))
    assert set(os.listdir("/proc/self/fd")) == before
    await Runtime(right).close()


async def test_a_robot_that_restarts_takes_its_doors_along(tmp_path: Path) -> None:
    started = Runtime(config(tmp_path / "data"))
    assert isinstance(started.clock, LockstepClock)
    await started.start()
    assert all(map(answers, PORTS))
    action = started.fleet.robots["a"][Power].shut_down(restart_after=5.0)
    await started.clock.advance(3.0)
    assert action.status.ended
    await until(lambda: not any(map(answers, PORTS)))
    await started.clock.advance(60.0)
    await until(lambda: all(map(answers, PORTS)))
    await started.close()
    assert not any(map(answers, PORTS))


def test_a_start_loads_nothing_for_later(tmp_path: Path) -> None:
    run = [sys.executable, "-c", OPENED, str(tmp_path / "data")]
    ended = subprocess.run(run, capture_output=True, text=True, check=True)
    assert ended.stdout == "[]\n"


def test_uvicorn_comes_without_its_command_line() -> None:
    found = subprocess.run([sys.executable, "-c", CONNECTED], stdout=subprocess.PIPE, text=True, check=True)
    assert found.stdout.strip() == "set()"
