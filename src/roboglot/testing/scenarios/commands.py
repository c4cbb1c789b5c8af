"""Commands of a scenario: each ends within its time, and all that they have left running ends with the scenario.

They are children of a keeper (``hosting.command_keeper``), which is started with the first one, and which finds what
has left their sessions and environments, even after this process was killed.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path
from select import select

from roboglot.hosting import command_keeper
from roboglot.hosting.leftovers import MARK, end_marked

OUTPUT_MAX = 1 << 20  # bytes kept of the end of a command's output
CHUNK = 1 << 16
LAST_SECONDS = 0.5  # s for output after the end of a command: others may hold it open for longer
END_SECONDS_MAX = 30.0  # s for the keeper to end all


class NotEnded(TimeoutError):
    """The command has not ended in time; the message is its output."""


class Commands:
    """Runs commands in ``folder``, all with one ``environment``; ``close`` ends what they have left."""

    def __init__(self, folder: Path, environment: Callable[[], Mapping[str, str]]) -> None:
        self._folder, self._environment = folder, environment
        self._mark = ":".join(filter(None, (os.environ.get(MARK), uuid.uuid4().hex)))
        self._keeper: subprocess.Popen[bytes] | None = None
        self._link: socket.socket | None = None

    def run(self, command: str, seconds: float) -> tuple[int, str]:
        """Return the exit status, negative for a signal, and the output's end. Raises NotEnded, OSError."""
        link, end = self._link or self._start(), time.monotonic() + seconds  # noqa: TID251 - real time
        ours, theirs = os.pipe()
        output = _Output(ours)
        try:
            command_keeper.send(link, command, theirs)
        finally:
            os.close(theirs)
            output.start()
        ready, _, _ = select([link], [], [], max(0.0, end - time.monotonic()))  # noqa: TID251
        if not ready:
            self.close()
            raise NotEnded(output.text())
        packet = link.recv(command_keeper.STATUS.size)
        if not packet:
            raise OSError(f"the process that runs commands was ended\n{output.text()}")
        (status,) = command_keeper.STATUS.unpack(packet)
        return status, output.text()

    def close(self) -> None:
        """End all that commands have started, in whichever session."""
        if self._link is not None and self._keeper is not None:
            self._link.close()
            self._link = None
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._keeper.wait(END_SECONDS_MAX)
        end_marked(self._mark)  # the keeper itself may have been killed

    def _start(self) -> socket.socket:
        """Start the keeper. Raises OSError."""
        ours, theirs = socket.socketpair()
        with theirs:
            try:
                self._keeper = subprocess.Popen(
                    [sys.executable, "-P", "-m", command_keeper.__name__, str(theirs.fileno()), self._mark],
                    cwd=self._folder,
                    env={name: value for name, value in self._environment().items() if name != MARK},
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    pass_fds=[theirs.fileno()],
                    start_new_session=True,
                )
            except BaseException:
                ours.close()
                raise
        self._link = ours
        return ours


class _Output:
    """Reads a pipe until all have closed it, which may be long after the command's end; keeps the end of it."""

    def __init__(self, pipe: int) -> None:
        self._pipe, self._kept = pipe, bytearray()
        self._reading = threading.Thread(target=self._read, name="output of a command", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._reading.start()

    def text(self) -> str:
        """Return what was read until all have closed the pipe, or ``LAST_SECONDS`` s have passed."""
        self._reading.join(LAST_SECONDS)
        return bytes(self._kept).decode(errors="replace").replace("\r\n", "\n")

    def _read(self) -> None:
        while chunk := os.read(self._pipe, CHUNK):
            self._kept += chunk
            del self._kept[:-OUTPUT_MAX]
        os.close(self._pipe)
