"""Keeps one robot connected: begins, serves until the link breaks, backs off, begins again.

Independent of the protocol: the driver supplies ``begin`` and ``serve``. A supervisor is the only owner of its
connection.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable, Coroutine

from roboglot.clients.errors import ClientError
from roboglot.model.clock import Clock
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Refused

log = logging.getLogger(__name__)
PAUSE_MIN, PAUSE_MAX = 0.5, 10.0  # s between two attempts
STEADY = 5.0  # s of connection that reset the back-off, so that a flapping link is retried less and less often
SENDING_MAX = 32  # pending commands sent without waiting, stops apart
PARTING_SECONDS = 1.0  # real seconds for the last command: time-outs on a stopped virtual clock never expire


class Supervisor:
    """Runs ``begin`` (connect and probe the robot) and ``serve``, which ends by raising ClientError or OSError."""

    def __init__(
        self, link: Link, clock: Clock, begin: Callable[[], Awaitable[None]], serve: Callable[[], Awaitable[None]]
    ) -> None:
        self.link = link
        self.touches = True  # whether the driver may change the state of the robot; false for observers
        self._clock, self._begin, self._serve = clock, begin, serve
        self._task: asyncio.Task[None] | None = None
        self._sending: set[asyncio.Task[None]] = set()
        self._first = asyncio.Event()

    def start(self) -> None:
        """Begin to connect; needs a running loop."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name=f"link to {self.link.address}")

    async def first_try(self) -> None:
        """Wait until the first attempt has succeeded or failed."""
        await self._first.wait()

    async def close(self, stop: Coroutine[None, None, None]) -> None:
        """Close the connection for good, after ``stop`` has halted the robot or PARTING_SECONDS have passed."""
        stopping = asyncio.get_running_loop().create_task(stop, name=f"stopping {self.link.address}")
        _, late = await asyncio.wait([stopping], timeout=PARTING_SECONDS)
        if late:
            log.warning("%s did not confirm the final stop", self.link.address)
        self.link.move_to(LinkState.CLOSED, "closed")
        tasks = [task for task in (stopping, self._task, *self._sending) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def require(self) -> None:
        """Raise Unconnected without a link, Refused while too many commands are pending."""
        self.link.require()
        if len(self._sending) >= SENDING_MAX:
            raise Refused(f"{SENDING_MAX} commands are pending on the link to the robot already")

    def send(self, what: str, command: Coroutine[None, None, object], *, always: bool = False) -> None:
        """Send a command without waiting; log a failure. Raises what ``require`` does, at once.

        ``always``: also send it while too many commands are pending. For stops, and for what is sent once at a time.
        """
        try:
            if always:
                self.link.require()
            else:
                self.require()
        except Exception:
            command.close()
            raise
        task = asyncio.get_running_loop().create_task(self._send(what, command), name=what)
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)

    def send_setting(self, what: str, command: Callable[[], Awaitable[None]], undo: Callable[[], object]) -> None:
        """Send a setting without waiting; call ``undo`` if the robot refuses it. Raises what ``require`` does.

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
                log.info("connected to %s", self.link.address)
                self._first.set()
                up_since = self._clock.time()
                await self._serve()
                reason = "the robot ended the connection"
            except ClientError as error:
                reason = str(error)
            except OSError as error:
                reason = error.strerror or type(error).__name__  # its text may name a local file
            except Exception:
                log.exception("driver of %s failed", self.link.address)
                reason = "internal error of the driver"
            if self.link.state is LinkState.UP:
                log.warning("lost %s: %s", self.link.address, reason)
            elif reason != self.link.reason:
                log.warning("cannot reach %s yet: %s", self.link.address, reason)
            if self._clock.time() - up_since >= STEADY:
                pause = PAUSE_MIN
            first = self.link.state is LinkState.CONNECTING
            self.link.move_to(LinkState.CONNECTING if first else LinkState.LOST, reason)
            self._first.set()
            await self._clock.sleep(pause)
            pause = min(pause * 2, PAUSE_MAX)
