"""Texts to and from a robot over a WebSocket: frames of block programs at ``/programs``, their log at ``/log``.

Knows no frame: what the texts say is the caller's business.
"""

from __future__ import annotations

import asyncio
from urllib.parse import urlsplit

from roboglot.clients.errors import BadAnswer, LinkLost
from roboglot.wire.visual.websocket import (
    OPENING_MAX,
    Broken,
    Message,
    MessageReader,
    Opcode,
    accept_of,
    encode,
    goodbye,
    new_key,
    parse_opening,
    request_opening,
)

CHUNK = 65_536  # bytes read at once
ANSWER_MAX = 256 * 1024 * 1024  # bytes of one text: lists of ten thousand tasks with their editor's texts are long


class TextLink:
    """Made by ``open``; iterate over it for what comes, until the robot goes away."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer
        self._messages = MessageReader(masked=False, limit=ANSWER_MAX)
        self._waiting: list[Message] = []

    @classmethod
    async def open(cls, address: str, path: str) -> TextLink:
        """Connect to ``address``, such as "ws://127.0.0.1:50053".

        Raises LinkLost, BadAnswer, ValueError for what is no address.
        """
        parts = urlsplit(address)
        if parts.scheme != "ws" or not parts.hostname or not parts.port:
            raise ValueError(f"a robot's address is ws://HOST:PORT, not {address!r}")
        try:
            reader, writer = await asyncio.open_connection(parts.hostname, parts.port, limit=OPENING_MAX)
        except OSError as error:
            raise LinkLost(f"no answer from {address}: {error.strerror or error}") from None
        link = cls(reader, writer)
        try:
            await link._greet(f"{parts.hostname}:{parts.port}", path)
        except BaseException:
            await link.close()
            raise
        return link

    async def _greet(self, host: str, path: str) -> None:
        key = new_key()
        self._writer.write(request_opening(host, path, key))
        try:
            head = await self._reader.readuntil(b"\r\n\r\n")
            answer = parse_opening(head.removesuffix(b"\r\n\r\n"))
        except (asyncio.IncompleteReadError, ConnectionError) as error:
            raise LinkLost(f"{host} hung up: {error}") from None
        except (asyncio.LimitOverrunError, Broken) as error:
            raise BadAnswer(f"{host} is no WebSocket: {error}") from None
        if " 101 " not in answer.line:
            raise BadAnswer(f"{host}{path} answers {answer.line}")
        if answer.headers.get("sec-websocket-accept") != accept_of(key):
            raise BadAnswer(f"{host}{path} is no WebSocket")

    async def send(self, text: str) -> None:
        """Raises LinkLost."""
        try:
            self._writer.write(encode(Opcode.TEXT, text.encode(), masked=True))
            await self._writer.drain()
        except OSError as error:
            raise LinkLost(f"the robot is gone: {error}") from None

    def __aiter__(self) -> TextLink:
        return self

    async def __anext__(self) -> str:
        while True:
            while self._waiting:
                message = self._waiting.pop(0)
                match message.opcode:
                    case Opcode.TEXT:
                        return message.text
                    case Opcode.PING:
                        self._writer.write(encode(Opcode.PONG, message.data, masked=True))
                    case Opcode.CLOSE:
                        raise StopAsyncIteration
            try:
                data = await self._reader.read(CHUNK)
                self._waiting += self._messages.feed(data)
            except Broken as error:
                raise BadAnswer(str(error)) from None
            except OSError:
                data = b""
            if not data:
                raise StopAsyncIteration

    async def close(self) -> None:
        """Say goodbye and hang up."""
        if not self._writer.is_closing():
            self._writer.write(encode(Opcode.CLOSE, goodbye(1000), masked=True))
        self._writer.close()
        try:
            await self._writer.wait_closed()
        except OSError:
            return  # it was gone already
