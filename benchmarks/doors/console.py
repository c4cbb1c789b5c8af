"""What pages cost: robots with lidars, viewers over real sockets; processor time of the program, share of a core.

.venv/bin/python -m benchmarks.doors.console [robots] [viewers] [seconds]
"""

from __future__ import annotations

import asyncio
import resource
import statistics
import sys
import tempfile
from dataclasses import replace

from wsproto import ConnectionType, WSConnection
from wsproto.events import AcceptConnection, BytesMessage, Request, TextMessage

from roboglot.config import ConsoleConfig, RobotConfig, load_config, with_addresses
from roboglot.runtime import Runtime


async def view(host: str, port: int, robot: str, received: list[int]) -> None:
    """Look at one robot until cancelled, as a page does; count bytes."""
    reader, writer = await asyncio.open_connection(host, port)
    socket = WSConnection(ConnectionType.CLIENT)
    writer.write(socket.send(Request(host=f"{host}:{port}", target="/live")))
    while data := await reader.read(1 << 16):
        received[0] += len(data)
        socket.receive_data(data)
        for event in socket.events():
            if isinstance(event, AcceptConnection):
                writer.write(socket.send(TextMessage(f'{{"type":"watch","robot":"{robot}"}}')))
            elif isinstance(event, TextMessage | BytesMessage):
                received[1] += 1


def processor() -> float:
    """Seconds that this program has used."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


async def share(seconds: float) -> float:
    """The share of a core that this program uses now; the median of five looks."""
    shares = []
    for _ in range(5):
        before = processor()
        await asyncio.sleep(seconds / 5)
        shares.append((processor() - before) / (seconds / 5))
    return statistics.median(shares)


async def main(robots: int, viewers: int, seconds: float) -> None:
    """Print the share without and with viewers (these run in the same process, so theirs is in it)."""
    names = [f"r{number}" for number in range(robots)]
    with tempfile.TemporaryDirectory() as folder:
        base = load_config(None, {"data": folder, "world": "empty"})
        placed = with_addresses(tuple(RobotConfig(name, "universal") for name in names))
        runtime = Runtime(replace(base, robots=placed, console=ConsoleConfig(port=0)))
        await runtime.start()
        assert runtime.console is not None
        await runtime.console.ready()
        await asyncio.sleep(20.0)  # until kernels are loaded and maps are drawn
        alone = await share(seconds)
        received = [0, 0]
        host, _, port = runtime.console.address.removeprefix("http://").rpartition(":")
        tasks = [asyncio.create_task(view(host, int(port), names[n % robots], received)) for n in range(viewers)]
        await asyncio.sleep(2.0)
        received[:] = [0, 0]
        watched = await share(seconds)
        for task in tasks:
            task.cancel()
        print(f"{robots} robots: {alone:.1%} of a core; with {viewers} viewers (and their clients): {watched:.1%}")
        each = viewers * seconds
        print(f"a viewer gets {received[1] / each:.1f} messages and {received[0] / each / 1024:.1f} KB a second")
        await runtime.close()


if __name__ == "__main__":
    given = [float(text) for text in sys.argv[1:]]
    asyncio.run(main(*(int(v) for v in (given + [10, 5][len(given) :])[:2]), given[2] if len(given) > 2 else 10.0))
