"""A fleet on Ray: every shard is a named actor. Ray places shards, detects dead ones and restarts them elsewhere.

This side only polls each actor's state, once a second, and stores its log lines.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import sqlite3
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Protocol

import msgspec

from roboglot.extras import explaining, own_version
from roboglot.hosting.error_text import in_words
from roboglot.shards.actor import Condition, ShardActor, Version
from roboglot.shards.joining import LOCAL, NAMESPACE
from roboglot.shards.messages import Beat
from roboglot.shards.plan import FleetPlan, ShardPlan, save
from roboglot.shards.ray_processes import RayProcesses
from roboglot.shards.states import DETACHED, LOG_FILE, Shard, Shards, State, detached_on, rotate
from roboglot.storage.dead_programs import DeadProgramWatch
from roboglot.storage.opening import open_registry
from roboglot.storage.registry_lease import LEASE, holder_of
from roboglot.storage.robot_registry import RobotRegistry
from roboglot.transport.log_limiter import LogLimiter

with explaining("--on", "fleet"):
    import ray
    from ray.exceptions import RayActorError, RayError, RayTaskError

log = logging.getLogger(__name__)
PERIOD = 1.0  # s between two checks of each shard
LOOK_MAX = 5.0  # s for an actor to answer
START_MAX = 90.0  # s for every shard to report
STOP_MAX = 15.0
CORE_EACH, CORES_MAX = 0.05, 1.0  # processors per robot, and per shard: a world runs in one thread
MEMORY = 256 << 20  # bytes that Ray reserves for a shard


class Reference(Protocol):
    """Ray's result of a call."""

    def future(self) -> Future[bytes]:
        """Return a future of the call's result."""


class Call(Protocol):
    """A method of an actor."""

    def remote(self, *values: int) -> Reference:
        """Call the method."""


class Actor(Protocol):
    """Handle of a ``ShardActor``."""

    look: Call
    stop: Call


class ClusterFleet:
    """One fleet on a joined cluster. ``lasting``: its shards outlive this program; a file in the folder names it."""

    def __init__(self, plan: FleetPlan, folder: Path, where: str, *, lasting: bool = False) -> None:
        """``folder``: locked for this program."""
        self.plan, self.folder, self._where, self._lasting, self._local = plan, folder, where, lasting, where == LOCAL
        self.shards = Shards(plan, folder)
        self._mark = holder_of(folder)[:8]  # a folder of this name may be there on other machines
        self._ray = RayProcesses()
        self._actors: dict[str, Actor] = {}
        self._nodes: dict[str, str] = {}
        self._seen_last: dict[str, Condition] = {}  # by shard
        self._watch: asyncio.Task[None] | None = None
        self._registry_watch: asyncio.Task[None] | None = None
        self._loop = asyncio.get_running_loop()
        self.ended: asyncio.Future[None] = self._loop.create_future()

    @property
    def nursery(self) -> int:
        """0: each node has one of its own."""
        return 0

    @property
    def stores_here(self) -> bool:
        """True if the cluster is this machine."""
        return self._local

    async def start(self) -> float:
        """Start all shards, or find running ones; return 0 (s, nothing is loaded here) when each is ready or failed.

        Raises OSError in one sentence.
        """
        save(self.plan, self.folder)
        await self._end_strangers()
        if self._lasting:
            (self.folder / DETACHED).write_text(self._where, encoding="utf-8")
        for shard in self.shards.values():
            await self._begin(shard)
        self._registry_watch = self._loop.create_task(_free_dead_robots(self.plan), name="watch for dead programs")
        self._watch = self._loop.create_task(self._run(), name="looks at shards")
        try:
            await asyncio.wait_for(self.shards.settle(), START_MAX)
        except TimeoutError:
            waiting = [shard.plan.name for shard in self.shards.values() if not shard.is_settled]
            log.warning("shards %s are not up yet; perhaps the cluster has no room", ", ".join(waiting))
        return 0.0

    async def close(self) -> None:
        """Stop all shards, unless ``lasting`` and one of them can start."""
        self.shards.end()
        tasks = [task for task in (self._watch, self._registry_watch) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if not self._lasting or all(shard.hopeless for shard in self.shards.values()):
            ends = await asyncio.gather(*map(self._end, self.shards.values()), return_exceptions=True)
            for error in ends:
                if isinstance(error, Exception):
                    log.warning("ending a shard: %s", _first_line(error))
            if detached_on(self.folder) == self._where and not any(ends):
                (self.folder / DETACHED).unlink()

    async def stop(self, shard: Shard) -> None:
        """Stop a shard and leave it stopped."""
        if shard.state is not State.STOPPED:
            self.shards.turn_to(shard, State.STOPPING)
            await self._end(shard)
            shard.pid, shard.beat = 0, Beat(0.0, 0, 0.0)
            self.shards.turn_to(shard, State.STOPPED)

    async def restart(self, shard: Shard) -> None:
        """Restart a shard, or start it; return when it is ready or has failed. Raises FleetEnds, OSError."""
        try:
            await self.stop(shard)
            shard.hopeless, shard.reason = False, ""
            await self._begin(shard)
            await asyncio.wait_for(self.shards.until(lambda: shard.is_settled), START_MAX)
        except TimeoutError:
            raise TimeoutError(f"shard {shard.plan.name} is not up yet; perhaps the cluster has no room") from None

    async def _begin(self, shard: Shard) -> None:
        """Create the shard's actor, or find a running one. Raises OSError in one sentence."""
        with _in_a_sentence():
            self._actors[shard.plan.name] = await asyncio.to_thread(self._actor, shard)
        self._seen_last.pop(shard.plan.name, None)
        shard.ready, shard.beat = None, Beat(0.0, 0, 0.0)
        self.shards.turn_to(shard, State.STARTING)

    def _actor(self, shard: Shard) -> Actor:
        plan = shard.plan
        cores = min(CORES_MAX, CORE_EACH * len(plan.robots))
        options = ray.remote(ShardActor).options(
            name=self._name(plan),
            namespace=NAMESPACE,
            get_if_exists=True,
            lifetime="detached" if self._lasting else None,
            max_restarts=-1,
            max_concurrency=4,
            num_cpus=cores,
            memory=MEMORY,
            scheduling_strategy="SPREAD",
        )
        actor: Actor = options.remote(plan.name, plan.settings, str(self.folder), of_node=not self._local)
        return actor

    def _name(self, plan: ShardPlan) -> str:
        """Return the name of a shard's actor, which differs with its settings: one that runs has those of its name."""
        settings = msgspec.json.encode(plan.settings, order="deterministic")
        return f"{self._mark}:{plan.name}:{hashlib.sha256(settings).hexdigest()[:8]}"

    async def _end_strangers(self) -> None:
        """End the shards of an earlier plan, which were detached. Raises OSError in one sentence."""
        known = {self._name(shard.plan) for shard in self.shards.values()}
        with _in_a_sentence():
            running = await asyncio.to_thread(ray.util.list_named_actors)
            strangers = [name for name in running if name.startswith(f"{self._mark}:") and name not in known]
            await asyncio.gather(*map(self._end_stranger, strangers))

    async def _end_stranger(self, actor: str) -> None:
        shard = actor.split(":")[1]
        log.warning("ending shard %s of an earlier plan", shard)
        await self._end_actor(shard, await asyncio.to_thread(ray.get_actor, actor))

    async def _end(self, shard: Shard) -> None:
        """End a shard's actor, if it has one. Raises OSError in one sentence."""
        if (actor := self._actors.pop(shard.plan.name, None)) is not None:
            with _in_a_sentence():
                await self._end_actor(shard.plan.name, actor)

    async def _end_actor(self, name: str, actor: Actor) -> None:
        try:
            await asyncio.wait_for(_answer(actor.stop.remote()), STOP_MAX)
        except (RayError, TimeoutError) as error:
            log.warning("killing shard %s: %s", name, type(error).__name__)
        await asyncio.to_thread(ray.kill, actor, no_restart=True)

    async def _run(self) -> None:
        seldom = LogLimiter(log)
        while True:
            if (why := self._ray.why_lost()) and not self.ended.done():
                self.ended.set_exception(OSError(why))
            ends = await asyncio.gather(*map(self._look, self.shards.values()), return_exceptions=True)
            for shard, error in zip(self.shards.values(), ends, strict=True):
                if isinstance(error, Exception):  # of Ray, whose client raises bare ones, too; of a full disk
                    seldom.warning(shard.plan.name, "looking at shard %s: %s", shard.plan.name, _first_line(error))
            await asyncio.sleep(PERIOD)

    async def _look(self, shard: Shard) -> None:
        actor = self._actors.get(shard.plan.name)
        if actor is None or shard.state in (State.STOPPING, State.STOPPED):
            return
        last = self._seen_last.get(shard.plan.name)
        known = last.birth if last is not None and shard.ready else 0
        answer = b""
        try:
            answer = await asyncio.wait_for(_answer(actor.look.remote(known)), LOOK_MAX)
            condition = msgspec.json.decode(answer, type=Condition)
        except (RayError, TimeoutError, TypeError, AttributeError, msgspec.DecodeError) as error:
            match _cause(error):
                case RayActorError() | TimeoutError():
                    self._missed(shard)
                case TypeError() | AttributeError() | msgspec.DecodeError():
                    self._cannot_read(shard, answer)
                case _:
                    shard.reason = _first_line(error)
                    self.shards.turn_to(shard, State.FAILED)
                    raise
        else:
            if actor is self._actors.get(shard.plan.name):
                self._seen(shard, condition)

    def _cannot_read(self, shard: Shard, answer: bytes) -> None:
        """Handle the answer of an actor that another version of roboglot started; empty: it has no such method."""
        name, version = shard.plan.name, _version_in(answer)
        if version in ("", own_version()):
            reason = f"it runs another version of roboglot; restart it: `roboglot fleet restart {name}`"
        else:
            reason = f"it runs roboglot {version}, not {own_version()}; restart it: `roboglot fleet restart {name}`"
        if reason != shard.reason:
            log.warning("shard %s cannot be served: %s", shard.plan.name, reason)
        shard.reason, shard.ready, shard.beat = reason, None, Beat(0.0, 0, 0.0)
        self.shards.turn_to(shard, State.FAILED)

    def _missed(self, shard: Shard) -> None:
        if shard.state is State.READY:
            log.warning("shard %s does not answer on %s", shard.plan.name, self._nodes.get(shard.plan.name))
            shard.reason = "it does not answer; Ray starts it again if its process or node is gone"
            shard.ready, shard.beat = None, Beat(0.0, 0, 0.0)
            self.shards.turn_to(shard, State.STARTING)

    def _seen(self, shard: Shard, condition: Condition) -> None:
        name = shard.plan.name
        is_new = self._count(shard, condition)
        is_news = condition.state is State.FAILED and condition.reason not in ("", shard.reason)
        shard.pid, self._nodes[name], self._seen_last[name] = condition.pid, condition.node, condition
        shard.heard = self._loop.time()
        shard.ready = (condition.ready or shard.ready) if condition.state is State.READY else None
        shard.beat, shard.reason, shard.hopeless = condition.beat, condition.reason, condition.hopeless
        if is_news and shard.hopeless:
            self.shards.refused(shard)
        elif is_news:
            log.warning("shard %s did not start: %s", name, shard.reason)  # it reports the same at each look
        if is_new or condition.state is not shard.state:
            self.shards.turn_to(shard, condition.state)
        shard.silent = condition.silent
        _keep(shard.folder / LOG_FILE, condition.lines)  # last, as the disk may be full

    def _count(self, shard: Shard, condition: Condition) -> bool:
        """Count restarts of the shard by its actor, and of the actor by Ray; return True if there were any."""
        last = self._seen_last.get(shard.plan.name)
        if last is None:
            new = condition.restarts
        elif last.run == condition.run:
            new = condition.restarts - last.restarts
        else:
            new, shard.ready = 1 + condition.restarts, None
        shard.restarts += new
        if new and last is not None:
            log.warning("shard %s restarted on %s", shard.plan.name, condition.node)
        return new > 0


@contextmanager
def _in_a_sentence() -> Iterator[None]:
    """Raise Ray's errors as OSError with their first line."""
    try:
        yield
    except RayError as error:
        raise OSError(_first_line(error)) from None


def _version_in(answer: bytes) -> str:
    """Return which version of roboglot sends an answer; empty if it does not say."""
    with suppress(msgspec.DecodeError):
        return msgspec.json.decode(answer, type=Version).version
    return ""


def _cause(error: Exception) -> Exception:
    """Return the error that a call raised in its actor; ``error`` if that is Ray's own."""
    return error.cause if isinstance(error, RayTaskError) else error


def _first_line(error: Exception) -> str:
    cause = _cause(error)
    return (in_words(cause).strip().splitlines() or [type(cause).__name__])[0]


async def _answer(reference: Reference) -> bytes:
    """Return the answer. Cancelling leaves Ray's own future alone: its late result would end in a traceback."""
    answer = asyncio.wrap_future(reference.future())
    answer.add_done_callback(lambda late: late.cancelled() or late.exception())  # also if it comes too late
    return await asyncio.shield(answer)


def _keep(path: Path, lines: list[str]) -> None:
    if lines:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        rotate(path)
        with path.open("a", encoding="utf-8") as file:
            file.write("\n".join([*lines, ""]))


async def _free_dead_robots(plan: FleetPlan) -> None:
    """Release dead shards' robots in the registry while Ray restarts the shards, which would otherwise wait for it."""
    if not (where := _registry_of(plan.shards[0])):
        return
    try:
        database = await asyncio.to_thread(open_registry, where)
    except (ValueError, OSError, sqlite3.Error) as error:
        log.warning("dead shards free their robots %g s later: cannot open the registry here: %s", LEASE, error)
        return
    try:
        await DeadProgramWatch(
            RobotRegistry(database), [robot for shard in plan.shards for robot in shard.robots]
        ).run()
    finally:
        database.close()


def _registry_of(shard: ShardPlan) -> str:
    return str(shard.settings.get("registry") or shard.settings.get("database") or "")


def refuse_unfenced(plan: FleetPlan, where: str) -> None:
    """Raise ValueError if robots could run twice on the cluster ``where``."""
    for shard in plan.shards[:1]:  # they differ only in names and addresses
        if where != LOCAL and not _registry_of(shard):
            raise ValueError(
                "a fleet on a cluster needs `database` or `registry` in its --template: without one, a robot could run"
                " on two machines when the network splits"
            )
