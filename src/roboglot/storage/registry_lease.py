"""Lease of a program's robots in the registry: taken before doors open, renewed, and lost in time.

The holder gives up its robots ``HOLD`` s after the start of its last successful renewal; another program takes them
after ``LEASE`` s without a renewal. Both use a clock that cannot be set, so that a robot never runs twice.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path

from roboglot.hosting.steady_time import uptime
from roboglot.storage.robot_registry import RobotRegistry, RobotsHeld
from roboglot.storage.transactions import FAILURES
from roboglot.transport.log_limiter import LogLimiter

log = logging.getLogger(__name__)
PERIOD, HOLD, LEASE = 0.5, 2.5, 4.0  # s between renewals; see above
HOLDER = "holder"  # file in the data folder


def holder_of(folder: Path) -> str:
    """Return the name under which a data folder's program holds robots; generated at the first call.

    As the folder's lock excludes a second program, robots held under this name before are free.
    """
    file = folder / HOLDER
    with contextlib.suppress(FileNotFoundError):
        if name := file.read_text(encoding="ascii").strip():
            return name
    name = uuid.uuid4().hex
    file.write_text(name, encoding="ascii")
    return name


class RegistryLease:
    """Lease of one program's robots. ``lost`` is called once with the name of a robot that must stop."""

    def __init__(
        self,
        registry: RobotRegistry,
        addresses: Mapping[str, str],
        holder: str,
        lost: Callable[[str], None],
        now: Callable[[], float] = uptime,
    ) -> None:
        self._registry, self._addresses, self._holder, self._lost, self._now = registry, addresses, holder, lost, now
        self._epochs: dict[str, int] = {}
        self._elsewhere: set[str] = set()  # taken permanently by another program
        self._reported: set[str] = set()
        self._until = -float("inf")
        self._tasks: list[asyncio.Task[None]] = []

    def refusal(self, robot: str) -> str:
        """Return why this program may not move the robot; empty: it may."""
        if robot in self._elsewhere:
            return "the robot runs in another program now"
        return "" if self._now() < self._until else "the registry of robots has not confirmed that it runs here"

    async def acquire(self) -> None:
        """Take the robots, if necessary after waiting for a dead program's lease. Raises OSError if one is in use."""
        began, silent = self._now(), dict[str, int]()
        try:
            try:
                self._epochs = await self._registry.take(self._addresses, self._holder, silent)
            except RobotsHeld as held:
                log.info("another program holds robots %s: waiting %g s for its next renewal", held, LEASE)
                began = await self._wait_for(held.renewals)
        except RobotsHeld as held:
            raise OSError(f"another program runs robot {held}") from None
        except FAILURES as error:
            raise OSError(f"the registry of robots: {error}") from None
        self._until = began + HOLD

    async def _wait_for(self, renewals: Mapping[str, int]) -> float:
        """Take the robots when they are released, or after ``LEASE`` s without a sign of life of their holders.

        Return the start time of the successful attempt. Raises RobotsHeld, DatabaseError.
        """
        end = self._now() + LEASE
        while (left := end - self._now()) > 0:
            await asyncio.sleep(min(PERIOD, left))
            began = self._now()
            with contextlib.suppress(RobotsHeld):
                self._epochs = await self._registry.take(self._addresses, self._holder, {})
                return began
        began = self._now()
        self._epochs = await self._registry.take(self._addresses, self._holder, renewals)
        return began

    async def announce(self, gateway: str, certificate: str) -> None:
        """Register the gateway for `roboglot connect` to these robots. Raises OSError."""
        try:
            await self._registry.announce(self._holder, gateway, certificate)
        except FAILURES as error:
            raise OSError(f"the registry of robots: {error}") from None

    def start_renewing(self) -> None:
        """Renew the lease regularly from now on."""
        loop = asyncio.get_running_loop()
        self._tasks = [
            loop.create_task(self._renew_periodically(), name="renewals of the claims to robots"),
            loop.create_task(self._watch(), name="watch over the claims to robots"),
        ]

    async def close(self) -> None:
        """Stop renewing, and release the robots."""
        for task in self._tasks:
            task.cancel()
        self._until = -float("inf")
        try:
            await self._registry.release(self._holder, self._epochs)
        except FAILURES as error:
            log.warning("the registry keeps this program's robots for %g s: %s", LEASE, error)

    async def renew(self) -> None:
        """Renew once. Raises DatabaseError."""
        began = self._now()
        held = await self._registry.renew(self._holder)
        missing = {
            robot: epoch
            for robot, epoch in self._epochs.items()
            if held.get(robot) != epoch and robot not in self._elsewhere
        }
        if missing:
            taken_back = await self._registry.take_back(missing, self._holder)
            self._epochs |= taken_back
            self._elsewhere |= missing.keys() - taken_back.keys()
        self._until = began + HOLD
        self.check()

    def check(self) -> None:
        """Report lost robots, and robots confirmed again."""
        for robot in self._addresses:
            why = self.refusal(robot)
            if not why and robot in self._reported:
                self._reported.discard(robot)
                log.warning("robot %s may be moved again: the registry confirmed it", robot)
            elif why and robot not in self._reported:
                self._reported.add(robot)
                log.error("robot %s is stopped: %s", robot, why)
                self._lost(robot)

    async def _renew_periodically(self) -> None:
        limited_log = LogLimiter(log)
        while True:
            await asyncio.sleep(PERIOD)
            try:
                await self.renew()
            except FAILURES as error:
                limited_log.warning("registry", "the registry of robots fails: %s", error)

    async def _watch(self) -> None:
        """Detect the end of the lease, even while a renewal waits for an answer."""
        while True:
            await asyncio.sleep(min(PERIOD, max(0.01, self._until - self._now())))
            self.check()
