"""One shard from within: a runtime on its own event loop that reports its health to the supervisor."""

from __future__ import annotations

import asyncio
import contextlib
import os
import resource
import signal
import socket
import sqlite3
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from roboglot.config import Config, config_of
from roboglot.hosting import open_files
from roboglot.hosting.closing import started
from roboglot.hosting.error_text import in_words
from roboglot.hosting.folder_lock import FolderInUse
from roboglot.hosting.logs import set_up_logging
from roboglot.hosting.process import end_in_any_case, prepare
from roboglot.model.errors import RobotError
from roboglot.protocols import sections
from roboglot.shards.messages import Beat, News, Ready, Refusal, encode

if TYPE_CHECKING:
    from roboglot.console.studio.programs import ClassHome
    from roboglot.runtime import Runtime

CLASS_SOCKET = "class"  # in the fleet's folder
SETTINGS = "shard.json"  # in the shard's folder, as in a configuration file
PERIOD = 1.0  # s between two heartbeats
WEIGHED = 10  # heartbeats between two measurements of memory, which take 3 ms
PACED = 5  # heartbeats over which the pace is measured: a tick of 20 ms is 2 % of one


def settings_of(values: dict[str, object], origin: str = "configuration") -> Config:
    """Return the configuration of a shard from its plan's values. Raises ValueError that names ``origin``."""
    return config_of(values, doors=sections(), origin=origin)


def write_settings(folder: Path, settings: dict[str, object]) -> None:
    """Write a shard's settings, which may hold a database's password, for their owner only. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    with (folder / SETTINGS).open("wb") as file:
        os.fchmod(file.fileno(), 0o600)
        file.write(msgspec.json.encode(settings))


def run(folder: str, link: socket.socket) -> int:
    """Serve until SIGTERM or the end of the supervisor; return the exit status."""
    set_up_logging(verbose=False)
    reporter = Reporter(link)
    try:
        config = settings_of(msgspec.json.decode((Path(folder) / SETTINGS).read_bytes(), type=dict))
    except (ValueError, OSError) as error:
        reporter.send(Refusal(in_words(error), lasting=True))
        return 1
    open_files.raise_limit()
    if shortage := open_files.shortage(len(config.robots)):
        reporter.send(Refusal(shortage, lasting=True))
        return 1
    prepare()
    import uvloop

    return uvloop.run(_serve(config, reporter, _class_home(Path(folder))))


def _class_home(folder: Path) -> ClassHome | None:
    """Return the socket of the fleet's classroom for this shard's folder; None if there is no classroom."""
    from roboglot.console.studio.programs import ClassHome

    path = folder.parent.parent / CLASS_SOCKET
    return ClassHome(path, folder.name) if path.exists() else None


class Reporter:
    """The shard's end of the link."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        link.setblocking(False)

    def send(self, message: News) -> None:
        """Send a message, or drop it: a supervisor that does not read must not block the robots."""
        with contextlib.suppress(OSError):
            self._link.send(encode(message))

    def watch(self, ended: asyncio.Event) -> None:
        """Set ``ended`` when the supervisor is gone."""

        def look() -> None:
            try:
                gone = not self._link.recv(1)
            except BlockingIOError:
                return
            except OSError:
                gone = True
            if gone:
                loop.remove_reader(self._link)
                ended.set()

        loop = asyncio.get_running_loop()
        loop.add_reader(self._link, look)


async def _serve(config: Config, reporter: Reporter, class_home: ClassHome | None) -> int:
    from roboglot.runtime import Runtime

    stop, loop = asyncio.Event(), asyncio.get_running_loop()
    open_files.OpenFiles().watch(loop)
    try:  # until there is something to close, SIGTERM ends the process at once: a silent database may block it
        runtime = Runtime(config, class_home=class_home)
    except (FolderInUse, ValueError, OSError, sqlite3.Error, RobotError) as error:
        # A killed predecessor may hold folder and addresses for a moment; wrong settings stay wrong.
        reporter.send(Refusal(_why(error), lasting=isinstance(error, ValueError)))
        return 1
    loop.add_signal_handler(signal.SIGTERM, stop.set)
    reporter.watch(stop)
    try:
        if not await started(runtime.start(), stop):
            return 0
        page = runtime.console.address if runtime.console is not None and runtime.console.port else ""
        endpoints = {
            name: [(endpoint.label, endpoint.address) for endpoint in doors.endpoints]
            for name, doors in runtime.doors.items()
        }
        reporter.send(Ready(endpoints, page))
        beating = asyncio.ensure_future(_beat(runtime, reporter))
        await stop.wait()
        end_in_any_case()
        beating.cancel()
    except (OSError, RobotError) as error:  # a taken address; nothing can be recorded; the database fails
        reporter.send(Refusal(_why(error), lasting=False))
        return 1
    finally:
        await runtime.close()
    return 0


def _why(error: Exception) -> str:
    """Return why a shard cannot start, in one sentence."""
    return open_files.in_words() if open_files.ran_out(error) else in_words(error)


async def _beat(runtime: Runtime, reporter: Reporter) -> None:
    loop, world = asyncio.get_running_loop(), runtime.fleet.world
    wanted = 1.0 if runtime.config.lockstep else runtime.config.speed
    memory, beats = _memory(), 0
    times = deque([(loop.time(), world.simulated)], maxlen=PACED + 1)  # real and simulated, s
    while True:
        await asyncio.sleep(PERIOD)
        beats += 1
        times.append((loop.time(), world.simulated))
        if beats % WEIGHED == 0:
            memory = _memory()
        real, simulated = (now - then for now, then in zip(times[-1], times[0], strict=True))
        reporter.send(Beat(simulated / real / wanted, memory, _cpu()))


def _memory() -> int:
    """Return the proportional set size (bytes), or the resident one if the system does not report the former."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/self/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) * 1024
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
