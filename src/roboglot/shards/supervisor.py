"""Keeps the shards of a fleet up: staggered starts, heartbeats, restarts with the same addresses and stored state."""

from __future__ import annotations

import asyncio
import fcntl
import logging
import os
import signal
from collections.abc import Callable
from pathlib import Path

import msgspec

from roboglot.hosting.process import has_ended
from roboglot.shards.memory import shortage
from roboglot.shards.messages import MESSAGE_MAX, Beat, News, Ready, Refusal
from roboglot.shards.nursery_client import NotWarm, NurseryClient, StartedNursery
from roboglot.shards.plan import FleetPlan, save
from roboglot.shards.shard import write_settings
from roboglot.shards.states import LOG_FILE, Shard, Shards, State, rotate

log = logging.getLogger(__name__)
STARTING_MAX = 2 * max(2, os.cpu_count() or 2)  # at the same time; a shard waits for the disk half of its start
SILENCE_MAX = 10.0  # s without a heartbeat after which a shard counts as hung
STALE = 3.0  # s without a heartbeat after which the last reported speed is no longer shown
START_MAX = 60.0  # s for a shard to become ready
STOP_MAX = 12.0  # s for it to close
REPORT_MAX = 5.0  # s for the nursery to report the end of a shard that was killed
SLOW, SLOW_FOR, SETTLING = 0.9, 10, 10.0  # x real time; checks in a row; s after the start that are not judged
STEADY = 60.0  # s of running after which earlier crashes are forgotten
PAUSES = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)  # s before the next attempt, by the number of crashes in a row


class Supervisor:
    """Supervisor of one fleet in one folder.

    ``start`` returns when every shard is ready or has failed; ``close`` ends them.
    """

    def __init__(
        self,
        plan: FleetPlan,
        folder: Path,
        *,
        memory_max: int = 0,
        nursery: StartedNursery | None = None,
        start: Callable[[], StartedNursery] | None = None,
    ) -> None:
        """``folder``: locked for this program; ``memory_max``: bytes per shard; 0: unlimited.

        ``nursery``, ``start``: of ``NurseryClient``. With ``start``, the plan is part of one that is stored already.
        """
        self._memory_max, self._is_whole = memory_max, start is None
        self.plan, self.folder = plan, folder
        self.shards = Shards(plan, folder)
        self._by_number = {shard.number: shard for shard in self.shards.values()}
        self._nursery = NurseryClient(self._born, self._dead, nursery, start)
        self._turn: asyncio.Task[None] | None = None
        self._watch: asyncio.TimerHandle | None = None
        self._loop = asyncio.get_running_loop()
        self.ended: asyncio.Future[None] = self._loop.create_future()
        self._wake = asyncio.Event()
        self._closing = False

    @property
    def nursery(self) -> int:
        """Process id of the nursery."""
        return self._nursery.pid

    @property
    def stores_here(self) -> bool:
        """True: the robots' data is stored in the shards' folders."""
        return True

    async def start(self) -> float:
        """Start all shards, in turn; return the nursery's warm-up time, s. Raises NotWarm, OSError."""
        if self._is_whole:
            save(self.plan, self.folder)
            if why := shortage(self.plan):
                log.warning(why)
        self._nursery.open()
        seconds = await self._nursery.warm()
        for shard in self.shards.values():
            self._enqueue(shard)
        self._turn = self._loop.create_task(self._start_in_turn(), name="starts of shards")
        self._watch = self._loop.call_later(1.0, self._look_after)
        await self.shards.settle()
        return seconds

    async def close(self) -> None:
        """Stop all shards and the nursery."""
        self._closing = True
        self.shards.end()
        for handle in (self._watch, self._turn, *(shard.again for shard in self.shards.values())):
            if handle is not None:
                handle.cancel()
        await self._nursery.close()
        for shard in self.shards.values():
            self._unlink(shard)

    async def stop(self, shard: Shard) -> None:
        """Stop a shard and leave it stopped. Raises FleetEnds."""
        if shard.again is not None:
            shard.again.cancel()
        if shard.state in (State.WAITING, State.FAILED):
            self._turn_to(shard, State.STOPPED)
        elif shard.state is not State.STOPPED:
            self._turn_to(shard, State.STOPPING)
            self._nursery.end(shard.number, signal.SIGTERM)
            await self.shards.until(lambda: shard.state is State.STOPPED)

    async def restart(self, shard: Shard) -> None:
        """Restart a shard, or start it; return when it is ready or has failed. Raises FleetEnds."""
        await self.stop(shard)
        shard.deaths, shard.hopeless, shard.reason = 0, False, ""
        self._enqueue(shard)
        await self.shards.until(lambda: shard.is_settled)

    def _enqueue(self, shard: Shard) -> None:
        self._turn_to(shard, State.WAITING)
        self._wake.set()

    async def _start_in_turn(self) -> None:
        """Fork waiting shards, few at a time."""
        while await self._wake.wait():
            self._wake.clear()
            starting = sum(shard.state is State.STARTING for shard in self.shards.values())
            waiting = [shard for shard in self.shards.values() if shard.state is State.WAITING]
            for shard in waiting[: max(0, STARTING_MAX - starting)]:
                await self._until_warm()
                if shard.state is State.WAITING:
                    self._fork(shard)

    async def _until_warm(self) -> None:
        """Wait for the nursery, even through restarts, without a limit."""
        while True:
            try:
                await self._nursery.warm()
                return
            except NotWarm as error:
                log.error("cannot start shards: %s", error)

    def _fork(self, shard: Shard) -> None:
        try:
            write_settings(shard.folder, shard.plan.settings)
            output = _open_log(shard.folder / LOG_FILE)
            try:
                shard.link = self._nursery.fork(shard.number, shard.folder, output)
            finally:
                os.close(output)
        except OSError as error:
            shard.reason = f"{error.filename or shard.folder}: {error.strerror or error}"
            self._failed(shard)
            return
        self._loop.add_reader(shard.link, self._receive, shard)
        shard.heard, shard.ready, shard.beat, shard.cause = self._loop.time(), None, Beat(0.0, 0, 0.0), ""
        self._turn_to(shard, State.STARTING)

    def _receive(self, shard: Shard) -> bool:
        """Handle one packet; return False if there is none."""
        if shard.link is None:
            return False
        try:
            packet = shard.link.recv(MESSAGE_MAX)
        except BlockingIOError:
            return False
        except OSError:
            packet = b""
        if not packet:
            self._unlink(shard)
            return False
        shard.heard = self._loop.time()
        match msgspec.json.decode(packet, type=News):
            case Ready() as ready:
                shard.ready, shard.reason = ready, ""
                if shard.state is State.STARTING:
                    self._turn_to(shard, State.READY)
            case Beat() as beat:
                shard.beat = beat
            case Refusal(reason=reason, lasting=lasting):
                shard.cause, shard.hopeless = reason, lasting
        return True

    def _born(self, number: int, pid: int) -> None:
        self._by_number[number].pid = pid

    def _dead(self, number: int, status: int) -> None:
        shard = self._by_number[number]
        while self._receive(shard):  # its last message
            pass
        self._unlink(shard)
        shard.pid, shard.beat = 0, Beat(0.0, 0, 0.0)
        if shard.state is State.STOPPING or self._closing:
            self._turn_to(shard, State.STOPPED)
            return
        if shard.state is State.READY and self._loop.time() - shard.since > STEADY:
            shard.deaths = 0
        shard.reason = shard.cause or (
            f"killed by {signal.Signals(-status).name}" if status < 0 else f"it ended with status {status}"
        )
        self._failed(shard)

    def _failed(self, shard: Shard) -> None:
        """Schedule another attempt: at once after the first crash, later after further ones."""
        pause = PAUSES[min(shard.deaths, len(PAUSES) - 1)]
        shard.deaths += 1
        if shard.hopeless:
            self.shards.refused(shard)
            self._turn_to(shard, State.FAILED)
            return
        shard.restarts += 1
        when = f"in {pause:g} s" if pause else "at once"
        log.warning("shard %s is down: %s; it starts again %s", shard.plan.name, shard.reason, when)
        if pause == 0.0:
            self._enqueue(shard)
            return
        self._turn_to(shard, State.FAILED)
        shard.again = self._loop.call_later(pause, self._enqueue, shard)

    def _look_after(self) -> None:
        """Kill hung shards, whose death triggers the restart, and a nursery that does not report it."""
        now = self._loop.time()
        for shard in self.shards.values():
            limit = {State.STARTING: START_MAX, State.READY: SILENCE_MAX, State.STOPPING: STOP_MAX}.get(shard.state)
            silent = now - (shard.since if shard.state is State.STOPPING else max(shard.heard, shard.since))
            if limit is not None and silent > limit:
                self._kill(shard, silent)
            elif shard.state is State.READY:
                shard.silent = silent if silent > STALE else 0.0
                if shard.silent:
                    shard.beat = msgspec.structs.replace(shard.beat, factor=0.0)
                self._judge(shard)
        self._watch = self._loop.call_later(1.0, self._look_after)

    def _kill(self, shard: Shard, silent: float) -> None:
        """Kill a hung shard; if the nursery has not reported its end after ``REPORT_MAX`` s, kill that."""
        if not shard.killed_at:
            log.error("shard %s has been silent for %.0f s while %s: killed", shard.plan.name, silent, shard.state)
            shard.cause = shard.cause or f"it hung while {shard.state}"
            shard.killed_at = self._loop.time()
        elif self._loop.time() - shard.killed_at > REPORT_MAX and has_ended(shard.pid):
            log.error("the nursery hangs: it does not report the end of shard %s: killed", shard.plan.name)
            self._nursery.kill()
            return
        self._nursery.end(shard.number, signal.SIGKILL)

    def _judge(self, shard: Shard) -> None:
        """Log that a shard is too slow, once per slowdown; restart a shard that uses too much memory."""
        slow = shard.beat.factor < SLOW and self._loop.time() - shard.since > SETTLING
        shard.slow_for = shard.slow_for + 1 if slow else 0
        if shard.slow_for == SLOW_FOR:
            log.warning("shard %s falls behind: %.2f x real time", shard.plan.name, shard.beat.factor)
        if self._memory_max and shard.beat.memory > self._memory_max:
            shard.cause = f"it had grown to {shard.beat.memory >> 20} MB of {self._memory_max >> 20}"
            shard.beat = Beat(0.0, 0, 0.0)  # each heartbeat is judged once
            self._nursery.end(shard.number, signal.SIGTERM)

    def _turn_to(self, shard: Shard, state: State) -> None:
        self.shards.turn_to(shard, state)
        self._wake.set()

    def _unlink(self, shard: Shard) -> None:
        if shard.link is not None:
            self._loop.remove_reader(shard.link)
            shard.link.close()
            shard.link = None


def _open_log(path: Path) -> int:
    """Return a descriptor that appends to the log, or to a new one if that is too long."""
    rotate(path)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
    fcntl.fcntl(descriptor, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    return descriptor
