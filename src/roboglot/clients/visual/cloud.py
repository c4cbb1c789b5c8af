"""The robot's link to its cloud: one POST per frame, over HTTP or HTTPS. Knows no program."""

from __future__ import annotations

import asyncio
import ssl
from urllib.parse import urlsplit

from roboglot.clients.errors import BadAnswer, LinkLost, TimedOut
from roboglot.model.clock import Clock, RealClock
from roboglot.wire.visual.cloud import ANSWER_MAX, ROBOT_HEADER, BadCloudAnswer, CloudAnswer, parse_answer

TIMEOUT = 3.0  # s per exchange, as in the vendor's robot
CHUNK = 65_536  # bytes


class CloudLink:
    """Link to a cloud. ``url``: without "/programs"; ``token``: an account's; ``robot``: one of the account's robots.

    Timeouts are in the machine's time unless another ``clock`` is given. Raises ValueError for an invalid address.
    """

    def __init__(self, url: str, token: str, robot: str, clock: Clock | None = None) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"a cloud's address is http://HOST or https://HOST, not {url!r}")
        if not token.isascii() or not token.isprintable():
            raise ValueError("a token has printable ASCII characters only")
        self._url = url
        self._host = parts.hostname
        self._security = ssl.create_default_context() if parts.scheme == "https" else None
        self._port = parts.port or (443 if self._security else 80)
        self._clock = clock or RealClock()
        self._head = (
            f"POST {parts.path.rstrip('/')}/programs HTTP/1.0\r\nHost: {parts.netloc}\r\nAuthorization: Bearer {token}"
            f"\r\n{ROBOT_HEADER}: {robot}\r\nContent-Type: application/json\r\nContent-Length: "
        )

    async def post(self, frame: str) -> CloudAnswer:
        """Send a frame and return the answer. Raises LinkLost, TimedOut, BadAnswer."""
        try:
            answer = await self._clock.wait_for(self._exchange(frame.encode("utf-8", "replace")), TIMEOUT)
        except TimeoutError:
            raise TimedOut(f"the cloud at {self._url} did not answer within {TIMEOUT:g} s") from None
        except OSError as error:
            raise LinkLost(f"the cloud at {self._url} cannot be reached: {error.strerror or error}") from None
        head, end, body = answer.partition(b"\r\n\r\n")
        if not end or not head.startswith(b"HTTP/1."):
            raise BadAnswer(f"the server at {self._url} does not speak HTTP")
        try:
            return parse_answer(body)
        except BadCloudAnswer as error:
            raise BadAnswer(str(error)) from None

    async def _exchange(self, body: bytes) -> bytes:
        """Send ``body`` and return the whole answer, up to the end of the connection."""
        reader, writer = await asyncio.open_connection(self._host, self._port, ssl=self._security)
        try:
            writer.write(f"{self._head}{len(body)}\r\n\r\n".encode() + body)
            answer = bytearray()
            while data := await reader.read(CHUNK):
                answer += data
                if len(answer) > ANSWER_MAX:
                    raise BadAnswer("the cloud's answer is too long")
            return bytes(answer)
        finally:
            writer.close()
