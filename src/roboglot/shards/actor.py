"""A shard as an actor of Ray: a thin process whose supervisor has the shard forked by the nursery of its node.

Ray restarts the actor if its process or node dies; the supervisor restarts the shard. This module and its imports load
no robot code, so that the process costs little more than Ray's own part of it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import secrets
import threading
import time
from collections import deque
from functools import partial
from pathlib import Path

import msgspec

from roboglot.extras import own_version
from roboglot.shards.messages import Beat, Ready
from roboglot.shards.ray_processes import keep_priority
from roboglot.shards.states import LOG_FILE, Shard, State

AGAIN_SECONDS = 5.0  # s between two attempts to start a nursery, and until an actor that failed exits
STOP_SECONDS = 14.0
LOOK_SECONDS = 4.0  # s for the supervisor to answer
LINES_MAX = 2000  # log lines kept until the fleet fetches them
PIECE_MAX = 1 << 17  # bytes of a shard's log for one look
EXIT_ENDED = 1
NODE_DIGITS = 12  # of a node's id
RUN_BITS = 52  # of a run's number, so that JSON keeps it exactly, also with restarts added
NODES = "nodes"  # folder in the fleet's folder, with one for each node

log = logging.getLogger(__name__)


class Condition(msgspec.Struct):
    """State of a shard, as of its supervisor. ``lines``: log lines since the last look.

    ``run``: a number that differs in every actor's process, unlike pids of different machines; ``restarts``: of the
    shard in this run. ``ready`` is left out if the client has it already, as a hundred robots' endpoints are long.
    ``version``: of roboglot.
    """

    pid: int
    node: str
    run: int
    restarts: int
    state: State
    silent: float
    ready: Ready | None
    beat: Beat
    reason: str
    hopeless: bool
    lines: list[str]
    version: str

    @property
    def birth(self) -> int:
        """Number of this start of the shard."""
        return self.run + self.restarts


class Version(msgspec.Struct):
    """The part of a Condition that every version of roboglot understands; the first ones sent none."""

    version: str = ""


class _Lines(logging.Handler):
    """Keeps log lines until they are fetched."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.kept: deque[str] = deque(maxlen=LINES_MAX)

    def emit(self, record: logging.LogRecord) -> None:
        self.kept.append(self.format(record))


class LogTail:
    """Reads what a shard writes to its log from now on, also after the log was replaced by a new one."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._at, self._file = self._identity() or (0, 0)
        self._rest = b""

    def read(self) -> list[str]:
        """Return the whole lines that were added since the last call, up to ``PIECE_MAX`` bytes."""
        if (found := self._identity()) is None:
            return []
        size, file = found
        if file != self._file or size < self._at:
            self._at, self._file, self._rest = 0, file, b""
        try:
            with self._path.open("rb") as log_file:
                log_file.seek(self._at)
                piece = log_file.read(PIECE_MAX)
        except OSError:
            return []
        self._at += len(piece)
        *lines, self._rest = (self._rest + piece).split(b"\n")
        self._rest = self._rest[-PIECE_MAX:]
        return [line.decode(errors="replace") for line in lines]

    def _identity(self) -> tuple[int, int] | None:
        """Return the log's size and inode; None without one."""
        try:
            found = self._path.stat()
        except OSError:
            return None
        return found.st_size, found.st_ino


class ShardActor:
    """Keeps one shard up, from its beginning to ``stop``.

    ``folder``: the fleet's. ``of_node``: nodes share no folders, so each uses a separate subfolder, and the shard's log
    lines reach the fleet by ``look``.
    """

    def __init__(self, name: str, settings: dict[str, object], folder: str, *, of_node: bool) -> None:
        keep_priority()
        import ray

        from roboglot.hosting.logs import in_shape, set_up_logging

        node = ray.get_runtime_context().get_node_id()
        self._node, self._nursery = node[:NODE_DIGITS], node
        self._run = secrets.randbits(RUN_BITS) or 1
        self._name, self._settings, self._folder = name, settings, Path(folder)
        self._shard: Shard | None = None
        self._reason = ""  # why there is no shard
        self._tail: LogTail | None = None
        if of_node:
            self._folder = self._folder / NODES / self._node
            self._settings = settings | {"data": str(Path(str(settings["data"])) / self._node)}
            self._tail = LogTail(self._folder / "shards" / name / LOG_FILE)
        set_up_logging(verbose=False)
        self._lines = _Lines()
        own = logging.getLogger("roboglot")
        own.setLevel(logging.INFO)
        own.addHandler(in_shape(self._lines))
        self._loop = asyncio.new_event_loop()
        self._keeping = self._loop.create_task(self._keep_up(), name="shard")
        self._thread = threading.Thread(target=self._serve, name="supervisor", daemon=True)
        self._thread.start()

    def look(self, known: int) -> bytes:
        """Return the encoded Condition. ``known``: the birth whose ``ready`` the client has. Raises TimeoutError."""
        return asyncio.run_coroutine_threadsafe(self._look(known), self._loop).result(LOOK_SECONDS)

    def stop(self) -> bytes:
        """Close robots and doors in order."""
        with contextlib.suppress(RuntimeError):  # it has ended already
            self._loop.call_soon_threadsafe(self._keeping.cancel)
        self._thread.join(STOP_SECONDS)
        return b""

    async def _look(self, known: int) -> bytes:
        lines = [self._lines.kept.popleft() for _ in range(len(self._lines.kept))]
        if self._tail is not None:
            lines = self._tail.read() + lines
        if (shard := self._shard) is None:
            nothing = Beat(0.0, 0, 0.0)
            state = State.FAILED if self._reason else State.STARTING
            reason, version = self._reason, own_version()
            return msgspec.json.encode(
                Condition(0, self._node, self._run, 0, state, 0.0, None, nothing, reason, False, lines, version)
            )
        condition = Condition(
            pid=shard.pid,
            node=self._node,
            run=self._run,
            restarts=shard.restarts,
            state=shard.state,
            silent=shard.silent,
            ready=shard.ready if shard.state is State.READY else None,
            beat=shard.beat,
            reason=shard.reason or ("" if shard.state is State.READY else self._reason),
            hopeless=shard.hopeless and shard.state is State.FAILED,  # else the reason has not come yet
            lines=lines,
            version=own_version(),
        )
        if condition.birth == known:
            condition.ready = None
        return msgspec.json.encode(condition)

    def _serve(self) -> None:
        """Run the supervisor in this thread; if that fails, have Ray start the actor again."""
        try:
            self._loop.run_until_complete(self._keeping)
        except asyncio.CancelledError:
            self._loop.run_until_complete(self._loop.shutdown_default_executor())
            self._loop.close()
        except BaseException:
            log.exception("the supervisor of shard %s ended", self._name)
            time.sleep(AGAIN_SECONDS)
            os._exit(EXIT_ENDED)

    async def _keep_up(self) -> None:
        """Keep the shard up until this is cancelled; also if the nursery cannot be started at first."""
        from roboglot.shards.node_client import connect, last_words
        from roboglot.shards.nursery_client import NotWarm
        from roboglot.shards.plan import FleetPlan, ShardPlan
        from roboglot.shards.supervisor import Supervisor

        plan = FleetPlan({}, [ShardPlan(self._name, self._settings)])
        while True:
            supervisor = Supervisor(plan, self._folder, start=partial(connect, self._nursery))
            try:
                (self._shard,) = supervisor.shards.values()
                supervisor.shards.report_hopeless()
                await supervisor.start()
                self._reason = ""
                await supervisor.ended  # it never does by itself
            except (NotWarm, OSError) as error:
                words = last_words(self._nursery) if isinstance(error, NotWarm) else ""
                self._reason = ": ".join(filter(None, (str(error), words)))
                log.error("cannot start shard %s: %s", self._name, self._reason)
            finally:
                await asyncio.shield(supervisor.close())
            self._shard = None
            await asyncio.sleep(AGAIN_SECONDS)
