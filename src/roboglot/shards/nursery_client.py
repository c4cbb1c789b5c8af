"""Handle of the nursery: starts it, has it fork shards, receives births and deaths; restarts it if it dies."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

import msgspec

from roboglot.shards.messages import MESSAGE_MAX, Birth, Born, Dead, End, Fork, Warm, encode, pair
from roboglot.shards.warm_up import ENVIRONMENT

log = logging.getLogger(__name__)
AGAIN_SECONDS = 5.0  # s between two attempts to start a nursery that does not become ready
ENDING_SECONDS = 0.5  # s between the end of the nursery's socket and of its process, at most
WARM_SECONDS_MAX = 240.0  # s to load everything; compiling kernels takes a minute


class NotWarm(RuntimeError):
    """The nursery did not come up."""


class NurseryProcess(Protocol):
    """A nursery's process, as of ``subprocess``."""

    pid: int

    def poll(self) -> int | None:
        """Return the status with which it ended; None: it has not."""

    def wait(self, timeout: float | None = None) -> int:
        """Return the status with which it ends. Raises subprocess.TimeoutExpired."""

    def kill(self) -> None:
        """Kill it."""


class StartedNursery(NamedTuple):
    """A nursery that was started, and our end of its control socket."""

    process: NurseryProcess
    control: socket.socket

    def abandon(self) -> None:
        """End it, if it has not ended."""
        with self.control:
            _kill(self.process)
            self.process.wait()


def _kill(nursery: NurseryProcess) -> None:
    """Kill a nursery, if it has not ended, and what compiles its kernels."""
    if nursery.poll() is None:
        os.killpg(nursery.pid, signal.SIGKILL)


def launch() -> StartedNursery:
    """Start a nursery; it loads in the background. Raises OSError."""
    ours, theirs = pair()
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-m", "roboglot.shards.nursery", str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            env=os.environ | ENVIRONMENT,
            stdin=subprocess.DEVNULL,
            process_group=0,  # the terminal's Ctrl-C is for the supervisor, which stops it in order
        )
    return StartedNursery(process, ours)


@contextlib.contextmanager
def launched(*, wanted: bool) -> Iterator[StartedNursery | None]:
    """Start a nursery if ``wanted``; it ends with the context, used or not. Raises OSError."""
    nursery = launch() if wanted else None
    try:
        yield nursery
    finally:
        if nursery is not None:
            nursery.abandon()


class NurseryClient:
    """The nursery of a supervisor. ``born`` and ``dead`` are called with a shard's number and its pid or status.

    ``nursery``: one that is loading already, to use first. ``start``: starts one, or connects to one, by default
    ``launch``.
    """

    def __init__(
        self,
        born: Callable[[int, int], None],
        dead: Callable[[int, int], None],
        nursery: StartedNursery | None = None,
        start: Callable[[], StartedNursery] | None = None,
    ) -> None:
        self._born, self._dead, self._launched, self._start = born, dead, nursery, start or launch
        self._control: socket.socket | None = None
        self._process: NurseryProcess | None = None
        self._living: set[int] = set()
        self._again: asyncio.TimerHandle | None = None
        self._warm: asyncio.Future[float] = asyncio.get_running_loop().create_future()
        self._closed = self._was_warm = False

    @property
    def pid(self) -> int:
        """Process id of the nursery; 0 if there is none."""
        return self._process.pid if self._process else 0

    def open(self) -> None:
        """Start the nursery; ``warm`` waits for it. Raises OSError."""
        nursery, self._launched = self._launched or self._start(), None
        self._process, self._control = nursery
        self._control.setblocking(False)
        asyncio.get_running_loop().add_reader(self._control, self._receive)

    async def warm(self) -> float:
        """Wait until the nursery can fork; return its loading time, s. Raises NotWarm."""
        try:
            return await asyncio.wait_for(asyncio.shield(self._warm), WARM_SECONDS_MAX)
        except TimeoutError:
            raise NotWarm(f"the nursery is not ready after {WARM_SECONDS_MAX:g} s") from None

    def fork(self, number: int, folder: Path, log_file: int) -> socket.socket:
        """Fork a shard whose output goes to ``log_file``; returns our end of the link. Raises OSError."""
        if self._control is None:
            raise OSError("there is no nursery")
        ours, theirs = pair()
        try:
            packet = encode(Fork(number, str(folder)))
            socket.send_fds(self._control, [packet], [theirs.fileno(), log_file])
        except BaseException:
            ours.close()
            raise
        finally:
            theirs.close()
        ours.setblocking(False)
        self._living.add(number)
        return ours

    def end(self, number: int, kind: signal.Signals) -> None:
        """Send a signal to a shard, if it is alive."""
        if self._control is not None and number in self._living:
            with contextlib.suppress(OSError):
                self._control.send(encode(End(number, kind)))

    def kill(self) -> None:
        """Kill the nursery, which is then started again."""
        if self._process is not None:
            self._process.kill()

    async def close(self) -> None:
        """End the nursery, and with it every shard."""
        self._closed = True
        if self._again is not None:
            self._again.cancel()
        if self._process is not None and not self._warm.done():
            _kill(self._process)  # it has no shards yet, and would load to the end
        self._let_go()
        if self._process is not None:
            await asyncio.to_thread(self._process.wait)

    def _receive(self) -> None:
        assert self._control is not None
        try:
            packet = self._control.recv(MESSAGE_MAX)
        except BlockingIOError:
            return
        except OSError:
            packet = b""
        if not packet:
            self._lost()
            return
        match msgspec.json.decode(packet, type=Birth):
            case Warm(seconds=seconds, pid=pid):
                self._was_warm = True
                if pid and self._process is not None:
                    self._process.pid = pid
                if not self._warm.done():
                    self._warm.set_result(seconds)
            case Born(number=number, pid=pid):
                self._born(number, pid)
            case Dead(number=number, status=status):
                self._living.discard(number)
                self._dead(number, status)

    def _lost(self) -> None:
        """Handle the end of the nursery, which its shards do not survive."""
        self._let_go()
        if self._closed:
            return
        status = self._status()
        if not self._was_warm:
            self._warm.set_exception(NotWarm(f"the nursery ended with {status} before it was ready"))
            return
        log.error("the nursery ended with %d; it is started again, and %d shards with it", status, len(self._living))
        living, self._living = self._living, set()
        if self._warm.done():
            self._warm = asyncio.get_running_loop().create_future()
            self._open_again()
        else:  # it died again before it was ready
            self._again = asyncio.get_running_loop().call_later(AGAIN_SECONDS, self._open_again)
        for number in living:
            self._dead(number, -signal.SIGKILL)

    def _status(self) -> int:
        """Return the status with which the nursery ended; one that only closed its socket is killed."""
        assert self._process is not None
        try:
            return self._process.wait(ENDING_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def _open_again(self) -> None:
        """Start the nursery, now or when there is room for another process."""
        try:
            self.open()
        except OSError as error:
            log.error("cannot start the nursery: %s; the next attempt is in %g s", error, AGAIN_SECONDS)
            self._again = asyncio.get_running_loop().call_later(AGAIN_SECONDS, self._open_again)

    def _let_go(self) -> None:
        if self._control is not None:
            asyncio.get_running_loop().remove_reader(self._control)
            self._control.close()
            self._control = None
