"""Texts to and from a robot over a WebSocket: frames of block programs at ``/programs``, their log at ``/log``.

Knows no frame; the callers interpret the texts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from roboglot.clients.errors import BadAnswer, LinkLost

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

ANSWER_MAX = 256 * 1024 * 1024  # bytes of one text: lists of ten thousand tasks with their editor texts are long
BROKEN = frozenset({1002, 1007, 1009})  # close codes for a robot that violates the protocol


class TextLink:
    """Link made by ``open``; iterate over it for the robot's texts, until the robot closes it."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection

    @classmethod
    async def open(cls, address: str, path: str) -> TextLink:
        """Connect to ``address``, such as "ws://127.0.0.1:50053".

        Raises LinkLost, BadAnswer, and ValueError for a malformed address.
        """
        from websockets.asyncio.client import connect
        from websockets.exceptions import InvalidHandshake, InvalidStatus

        parts = urlsplit(address)
        if parts.scheme != "ws" or not parts.hostname or not parts.port:
            raise ValueError(f"a robot's address is ws://HOST:PORT, not {address!r}")
        host = parts.netloc
        try:
            connection = await connect(
                f"ws://{host}{path}",
                compression=None,
                max_size=ANSWER_MAX,
                open_timeout=None,
                ping_interval=None,
                proxy=None,
                user_agent_header=None,
            )
        except InvalidStatus as error:
            response = error.response
            raise BadAnswer(f"{host}{path} answers {response.status_code} {response.reason_phrase}") from None
        except InvalidHandshake as error:
            if isinstance(error.__cause__, (EOFError, OSError)):
                raise LinkLost(f"{host} hung up: {error.__cause__}") from None
            raise BadAnswer(f"{host} does not speak WebSocket: {error}") from None
        except OSError as error:
            raise LinkLost(f"no answer at {address}: {error.strerror or error}") from None
        return cls(connection)

    async def send(self, text: str) -> None:
        """Send one text. Raises LinkLost."""
        from websockets.exceptions import ConnectionClosed

        try:
            await self._connection.send(text)
        except ConnectionClosed as error:
            raise LinkLost(f"the robot is gone: {error}") from None

    def __aiter__(self) -> TextLink:
        return self

    async def __anext__(self) -> str:
        from websockets.exceptions import ConnectionClosed

        while True:
            try:
                message = await self._connection.recv()
            except ConnectionClosed as closed:
                if closed.sent is not None and closed.sent.code in BROKEN and not closed.rcvd_then_sent:
                    raise BadAnswer(str(closed)) from None
                raise StopAsyncIteration from None
            if isinstance(message, str):
                return message

    async def close(self) -> None:
        """Close the connection."""
        await self._connection.close()
