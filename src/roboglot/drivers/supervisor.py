"""Keeps one robot connected: begins, serves until the link breaks, backs off, begins again.

Independent of the protocol: the driver supplies ``begin`` and ``serve``. A supervisor is the only owner of its
connection.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import AbstractContextManager

from roboglot.clients.errors import ClientError
from roboglot.confirmation import Sent, confirm
from roboglot.model.clock import Clock
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Refused, RobotError

log = logging.getLogger(__name__)
PAUSE_MIN, PAUSE_MAX = 0.5, 10.0  # s between two attempts
STEADY = 5.0  # s of connection that reset the back-off, so that a flapping link is retried less and less often
SENDING_MAX = 32  # pending commands sent without waiting, stops apart
PARTING_SECONDS = 1.0  # real seconds for the last command: time-outs on a stopped virtual clock never expire


class Supervisor:
    """Runs ``begin`` (connect and probe the robot) and ``serve``, which ends by raising ClientError or OSError.

    ``robot_errors``: context that raises the client's errors as the model's.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        begin: Callable[[], Awaitable[None]],
        serve: Callable[[], Awaitable[None]],
        robot_errors: Callable[[], AbstractContextManager[None]],
    ) -> None:
        self.link = link
        self.touches = True  # whether the driver may change the state of the robot; false for observers
        self._clock, self._begin, self._serve, self._robot_errors = clock, begin, serve, robot_errors
        self._task: asyncio.Task[None] | None = None
        self._sending: set[Sent] = set()
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
        """Send a command without waiting; the present request is answered once the robot has confirmed it.

        ``always``: also send it while too many commands are pending: for stops. Raises what ``require`` does, at once.
        """
        try:
            if always:
                self.link.require()
            else:
                self.require()
        except Exception:
            command.close()
            raise
        confirm(self._begin_sending(what, command))

    def send_aside(self, what: str, command: Coroutine[None, None, object]) -> None:
        """Send what no request waits for, even while too many commands are pending. Raises Unconnected."""
        try:
            self.link.require()
        except Exception:
            command.close()
            raise
        self._begin_sending(what, command)

    def _begin_sending(self, what: str, command: Coroutine[None, None, object]) -> Sent:
        task = asyncio.get_running_loop().create_task(self._send(what, command), name=what)
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)
        return task

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

    async def _send(self, what: str, command: Coroutine[None, None, object]) -> Exception | None:
        """Send a command; log and return the error of the robot or of the link."""
        try:
            with self._robot_errors():
                await command
        except RobotError as error:
            log.warning("%s: %s failed: %s", self.link.address, what, error)
            return error
        return None

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
