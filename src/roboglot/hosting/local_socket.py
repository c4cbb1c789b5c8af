"""A socket in a folder that only its owner can open: one line of JSON per request and answer."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
from collections.abc import Awaitable, Callable
from pathlib import Path

log = logging.getLogger(__name__)
LINE_MAX = 1024  # bytes of a request
ANSWER_MAX = 1 << 22  # bytes
CALLERS_MAX = 8
PATH_MAX = 107  # bytes of a socket's path: the system's limit


class LocalServer:
    """Answers the folder's owner, line by line. ``name``: command that a warning names if it cannot listen."""

    def __init__(self, path: Path, name: str, answer: Callable[[bytes], Awaitable[bytes]]) -> None:
        self._path, self._name, self._answer_to = path, name, answer
        self._server: asyncio.Server | None = None
        self._callers: dict[asyncio.StreamWriter, bool] = {}  # True: being answered; the longest idle comes first

    async def open(self) -> None:
        """Listen. On failure, log a warning; the program runs on without the socket."""
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._path.unlink(missing_ok=True)  # left by a killed program; no other program uses the folder
            if len(bytes(self._path)) > PATH_MAX:
                raise OSError("its path is too long")
            os.fchmod(listening.fileno(), 0o600)  # before binding, so that other users never have access
            listening.bind(bytes(self._path))
            self._server = await asyncio.start_unix_server(self._serve, sock=listening, limit=LINE_MAX)
        except OSError as error:
            listening.close()
            log.warning("`%s` cannot reach this program: %s: %s", self._name, self._path, error)

    async def close(self) -> None:
        """Stop listening."""
        if self._server is None:
            return
        self._server.close()
        for caller in self._callers:
            caller.transport.abort()
        self._path.unlink(missing_ok=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._callers[writer] = False
        self._make_room()
        try:
            while line := await reader.readline():
                self._callers[writer] = True
                answer = await self._answer_to(line)
                del self._callers[writer]
                self._callers[writer] = False
                writer.write(answer + b"\n")
                await writer.drain()
        except (ValueError, OSError):  # the line is too long; the caller has gone
            pass
        finally:
            self._callers.pop(writer, None)
            writer.transport.abort()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    def _make_room(self) -> None:
        """Hang up on the longest idle caller if there are too many: ``roboglot stop`` must get through."""
        if len(self._callers) > CALLERS_MAX:
            idle = next(caller for caller, answered in self._callers.items() if not answered)  # the new one, at least
            del self._callers[idle]
            idle.transport.abort()


async def ask(path: Path, request: bytes, seconds: float) -> bytes:
    """Return the answer's line. Raises OSError; its subclass TimeoutError after ``seconds``."""

    async def exchange() -> bytes:
        reader, writer = await asyncio.open_unix_connection(path, limit=ANSWER_MAX)
        try:
            writer.write(request + b"\n")
            return await reader.readline()
        finally:
            writer.close()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    line = await asyncio.wait_for(exchange(), seconds)
    if not line.endswith(b"\n"):
        raise OSError(0, "it hung up")
    return line
