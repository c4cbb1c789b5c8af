"""Keeps one robot connected: begin, serve until it breaks, wait a little longer each time, begin again.

Knows no protocol; the driver brings ``begin`` and ``serve``. One keeper is the only owner of its connection.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable, Coroutine

from roboglot.clients.errors import ClientError
from roboglot.model.clock import Clock
from roboglot.model.components.system.link import Link, LinkState

log = logging.getLogger(__name__)
PAUSE_MIN, PAUSE_MAX = 0.5, 10.0  # s between two tries
STEADY = 5.0  # s that a connection must last for the pauses to begin anew: a link that flaps is tried ever more seldom
SENDING_MAX = 32  # commands under way that nobody waits for
PARTING_SECONDS = 1.0  # real ones for the last command: a clock that nobody moves any more ends no time-out


async def together(*parts: Awaitable[None]) -> None:
    """All of them until one fails; then the others are cancelled."""
    tasks = [asyncio.ensure_future(part) for part in parts]
    try:
        await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class Supervisor:
    """``begin`` connects and learns what the robot has; ``serve`` ends by raising ClientError or OSError."""

    def __init__(
        self, link: Link, clock: Clock, begin: Callable[[], Awaitable[None]], serve: Callable[[], Awaitable[None]]
    ) -> None:
        self.link = link
        self.touches = True  # whether the robot's state may be changed at all; not by who only wants to watch
        self._clock, self._begin, self._serve = clock, begin, serve
        self._task: asyncio.Task[None] | None = None
        self._sending: set[asyncio.Task[None]] = set()
        self._first = asyncio.Event()

    def start(self) -> None:
        """Try to connect from now on; needs the running loop."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name=f"link to {self.link.address}")

    async def first_try(self) -> None:
        """Wait until the first try has succeeded or failed."""
        await self._first.wait()

    async def close(self, stop: Coroutine[None, None, None]) -> None:
        """Let go of the robot for good, once ``stop`` made it stand or could not within PARTING_SECONDS."""
        stopping = asyncio.get_running_loop().create_task(stop, name=f"stopping {self.link.address}")
        _, late = await asyncio.wait([stopping], timeout=PARTING_SECONDS)
        if late:
            log.warning("%s did not answer the last command, to stand still", self.link.address)
        self.link.move_to(LinkState.CLOSED, "closed")
        tasks = [task for task in (stopping, self._task, *self._sending) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def send(self, what: str, command: Coroutine[None, None, object]) -> None:
        """Have the robot told something that nobody waits for; a failure is logged. Raises Unconnected at once."""
        try:
            self.link.require()
        except Exception:
            command.close()
            raise
        if len(self._sending) >= SENDING_MAX:
            command.close()
            log.warning("%s: %s is not sent: too much is under way", self.link.address, what)
            return
        task = asyncio.get_running_loop().create_task(self._send(what, command), name=what)
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)

    def send_setting(self, what: str, command: Callable[[], Awaitable[None]], undo: Callable[[], object]) -> None:
        """Send a setting without waiting; call ``undo`` if the robot refuses it. Raises Unconnected without a link.

        Commands that follow are sent behind it, so they arrive after it.
        """

        async def send() -> None:
            try:
                await command()
            except BaseException:
                undo()
                raise

        self.send(what, send())

    async def _send(self, what: str, command: Coroutine[None, None, object]) -> None:
        try:
            await command
        except ClientError as error:
            log.warning("%s: %s failed: %s", self.link.address, what, error)

    async def _run(self) -> None:
        pause = PAUSE_MIN
        while True:
            up_since = math.inf
            try:
                await self._begin()
                self.link.move_to(LinkState.UP)
                log.info("%s is connected", self.link.address)
                self._first.set()
                up_since = self._clock.time()
                await self._serve()
                reason = "the robot ended the connection"
            except ClientError as error:
                reason = str(error)
            except OSError as error:
                reason = error.strerror or type(error).__name__  # its text may name a file of ours
            except Exception:
                log.exception("the driver of %s broke", self.link.address)
                reason = "internal error of the driver"
            if self.link.state is LinkState.UP:
                log.warning("%s is lost: %s", self.link.address, reason)
            if self._clock.time() - up_since >= STEADY:
                pause = PAUSE_MIN
            first = self.link.state is LinkState.CONNECTING
            if first and not self._first.is_set():
                log.warning("%s is not there yet: %s", self.link.address, reason)
            self.link.move_to(LinkState.CONNECTING if first else LinkState.LOST, reason)
            self._first.set()
            await self._clock.sleep(pause)
            pause = min(pause * 2, PAUSE_MAX)
