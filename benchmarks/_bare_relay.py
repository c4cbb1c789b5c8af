"""A relay that only passes bytes, with or without TLS at both ends: the least that any proxy adds.

python _bare_relay.py ADDRESS PORT HOST [FOLDER]; FOLDER: robot.pem and robot.key for the client, client-cert.pem and
client-key.pem for the robot. The loop's own TLS, no parsing, no file.
"""

from __future__ import annotations

import asyncio
import ssl
import sys
from pathlib import Path
from typing import cast

from roboglot.hosting.event_loop import run


class Side(asyncio.Protocol):
    """One end; ``other`` gets its bytes."""

    def __init__(self) -> None:
        self.other: asyncio.Transport | None = None
        self.waiting = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Write at once, as the proxy does."""
        self.transport = cast(asyncio.Transport, transport)
        self.transport.set_write_buffer_limits(high=0)

    def data_received(self, data: bytes) -> None:
        """Pass on."""
        if self.other is None:
            self.waiting += data
        else:
            self.other.write(data)

    def connection_lost(self, _exc: Exception | None) -> None:
        """Hang up at the other end."""
        if self.other is not None:
            self.other.close()


def context(folder: Path | None, names: tuple[str, str], purpose: ssl.Purpose) -> ssl.SSLContext | None:
    """Return a context that shows this certificate and checks none."""
    if folder is None:
        return None
    made = ssl.create_default_context(purpose)
    made.check_hostname, made.verify_mode = False, ssl.CERT_NONE
    made.load_cert_chain(folder / names[0], folder / names[1])
    made.set_alpn_protocols(["h2"])
    return made


async def relay(address: str, port: int, host: str, folder: Path | None) -> None:
    """Listen until the end of the process."""
    loop, tasks = asyncio.get_running_loop(), set[asyncio.Task[None]]()
    to_robot = context(folder, ("client-cert.pem", "client-key.pem"), ssl.Purpose.SERVER_AUTH)
    name = None if to_robot is None else host

    class Client(Side):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            super().connection_made(transport)
            task = loop.create_task(self.dial())
            tasks.add(task)
            task.add_done_callback(tasks.discard)

        async def dial(self) -> None:
            _, robot = await loop.create_connection(Side, host, port, ssl=to_robot, server_hostname=name)
            robot.other, self.other = self.transport, robot.transport
            for one, other in ((self, robot), (robot, self)):
                other.transport.write(one.waiting)

    as_robot = context(folder, ("robot.pem", "robot.key"), ssl.Purpose.CLIENT_AUTH)
    await loop.create_server(Client, address, port, ssl=as_robot)
    print(address, flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    where, number, robot = sys.argv[1:4]
    run(relay(where, int(number), robot, Path(sys.argv[4]) if sys.argv[4:] else None))
