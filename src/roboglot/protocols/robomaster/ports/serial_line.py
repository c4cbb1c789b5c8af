"""The robot's serial port as a pseudo-terminal: commands, answers, pushes and events as text, no video and no sound.

Programs open its symbolic link like ``/dev/ttyUSB0``. Every answer ends with a line feed, as on robots.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import tty
from collections.abc import Callable
from pathlib import Path

from roboglot.protocols.robomaster.limits import OUTPUT_MAX

READ_MAX = 4096  # bytes at a time
SERIAL = "serial line"  # the host of a client there
LINE_END = b"\n"


class SerialLine(asyncio.Transport):
    """A transport over the terminal's master side, for a protocol as on the control port; raises OSError."""

    def __init__(self, link: Path, protocol: Callable[[], asyncio.Protocol]) -> None:
        super().__init__({"peername": (SERIAL, 0)})
        self._link = link
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        self._slave = slave  # kept open, or the line would close with the first program
        self._closing = False
        if link.is_symlink():
            link.unlink()  # left by a run that ended badly
        link.symlink_to(os.ttyname(slave))
        self._protocol = protocol()
        self._protocol.connection_made(self)
        asyncio.get_running_loop().add_reader(self._master, self._read)

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """Write; bytes are lost if nothing reads and the line is full, as on a wire."""
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)

    def pause_reading(self) -> None:
        """Leave incoming bytes in the terminal's buffer."""
        asyncio.get_running_loop().remove_reader(self._master)

    def resume_reading(self) -> None:
        """Resume reading from the serial line."""
        if not self._closing:
            asyncio.get_running_loop().add_reader(self._master, self._read)

    def is_closing(self) -> bool:
        return self._closing

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:  # noqa: ARG002
        """Do nothing: the only buffer is the terminal's, far smaller than OUTPUT_MAX."""
        assert high is None or high <= OUTPUT_MAX

    def abort(self) -> None:
        """Close the line and remove its link."""
        if self._closing:
            return
        self._closing = True
        asyncio.get_running_loop().remove_reader(self._master)
        os.close(self._master)
        os.close(self._slave)
        self._link.unlink(missing_ok=True)
        self._protocol.connection_lost(None)

    def _read(self) -> None:
        with contextlib.suppress(BlockingIOError):
            self._protocol.data_received(os.read(self._master, READ_MAX))
