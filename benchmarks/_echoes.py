"""A robot with two bare servers in its event loop, which answer anything with as many bytes as its doors would.

``python -m _echoes up ...`` is ``roboglot up ...`` with them, at the first robot's address.
"""

from __future__ import annotations

import asyncio
from functools import partial
from typing import cast

from roboglot.__main__ import run
from roboglot.runtime import Runtime

REST_PORT, TEXT_PORT = 41448, 41923
BODY = b'{"x":-0.012345678901234567,"y":0.012345678901234567,"z":0.0,"yaw":-0.012345678901234567}'
ANSWERS = {
    REST_PORT: b"HTTP/1.1 200 OK\r\ncontent-type: application/json\r\ncontent-length: %d\r\n\r\n%s" % (len(BODY), BODY),
    TEXT_PORT: b"0.000 0.000 0.000;",
}


class _Bare(asyncio.Protocol):
    def __init__(self, answer: bytes) -> None:
        self._answer = answer

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, _data: bytes) -> None:
        self._transport.write(self._answer)


async def start(self: Runtime) -> None:
    await _start(self)
    for port, answer in ANSWERS.items():
        address = self.config.robots[0].address
        await asyncio.get_running_loop().create_server(partial(_Bare, answer), address, port)


if __name__ == "__main__":
    _start = Runtime.start
    Runtime.start = start  # type: ignore[method-assign]
    run()
