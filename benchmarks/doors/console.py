"""Claim: five viewers of 25 robots with lidars cost at most 5 % of a core.

Viewers connect over real sockets and run in the program that they look at, so their own work counts, too. Measurements
with and without them take turns, because the machine's other load changes.

    scripts/bench console [robots] [viewers] [seconds]
"""

from __future__ import annotations

import asyncio
import resource
import statistics
import sys
import tempfile
from dataclasses import replace

from _claim import Claims
from wsproto import ConnectionType, WSConnection
from wsproto.events import AcceptConnection, BytesMessage, Request, TextMessage

from roboglot.config import ConsoleConfig, RobotConfig, load_config, with_addresses
from roboglot.runtime import Runtime

TURNS = 3


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
    """Return the share of a core that this program uses now; the median of five looks."""
    shares = []
    for _ in range(5):
        before = processor()
        await asyncio.sleep(seconds / 5)
        shares.append((processor() - before) / (seconds / 5))
    return statistics.median(shares)


async def main(robots: int, viewers: int, seconds: float) -> None:
    """Print the share without and with viewers."""
    names = [f"r{number}" for number in range(robots)]
    with tempfile.TemporaryDirectory() as folder:
        base = load_config(None, {"data": folder, "world": "empty"})
        placed = with_addresses(tuple(RobotConfig(name, "universal") for name in names))
        runtime = Runtime(replace(base, robots=placed, console=ConsoleConfig(port=0)))
        await runtime.start()
        assert runtime.console is not None
        await runtime.console.ready()
        await asyncio.sleep(20.0)  # until kernels are loaded and maps drawn
        received = [0, 0]
        host, _, port = runtime.console.address.removeprefix("http://").rpartition(":")
        alone, watched = [], []
        for _ in range(TURNS):
            alone.append(await share(seconds))
            tasks = [asyncio.create_task(view(host, int(port), names[n % robots], received)) for n in range(viewers)]
            await asyncio.sleep(2.0)
            received[:] = [0, 0]
            watched.append(await share(seconds))
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        added = statistics.median(more - less for less, more in zip(alone, watched, strict=True))
        print(f"{robots} robots: {statistics.median(alone):.1%} of a core; with {viewers} viewers: {added:.1%} more")
        each = viewers * seconds
        print(f"a viewer gets {received[1] / each:.1f} messages and {received[0] / each / 1024:.1f} KB a second")
        await runtime.close()
    claims = Claims()
    claims.at_most(f"{viewers} viewers of {robots} robots", 100.0 * added, 5.0, "% of a core")
    claims.finish()


if __name__ == "__main__":
    robots, viewers, seconds = [*sys.argv[1:], *("25", "5", "10")[len(sys.argv) - 1 :]]
    asyncio.run(main(int(robots), int(viewers), float(seconds)))
