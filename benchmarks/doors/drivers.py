"""Claim: door and driver add <= 3 ms (median) to a command on its way to the robot; 50 Hz pushes pass without loss.

Three processes: the robot, the roboglot that drives it, and this one, which plays the client and, as a relay, watches
what arrives at the robot. The time is from the client's send to the relay's receipt; on a direct connection it is the
loopback's, which is printed beside. TLS seals a dog's connection, so there this process is robot and client, and the
time ends when the dog's base receives a velocity.
"""

from __future__ import annotations

import asyncio
import statistics
import tempfile
import time
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path

from _claim import Claims

from roboglot.clients.cyberdog.client import CyberDogClient
from roboglot.clients.cyberdog.link import Certificates
from roboglot.config import Config, RobotConfig
from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Twist
from roboglot.runtime import Runtime
from roboglot.testing.process import served
from roboglot.wire.cyberdog.chapters.motion.motion import Motion

ROBOT, FRONT, DRIVER, CLIENT = (f"127.0.55.{number}" for number in (11, 12, 13, 14))
RELAYED = {"slamware": (1448, 51448), "robomaster": (40923, 50923)}
DOG = "127.0.55.15"
ROUNDS = 100
PUSH_SECONDS = 10.0
PATIENCE = 2.0


class Relay:
    """Relay of a connection that notes when a certain message goes to the robot."""

    def __init__(self) -> None:
        self._wanted: tuple[bytes, ...] = ()
        self._seen: asyncio.Future[float] | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def open(self, target: int, port: int) -> None:
        async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            far_reader, far_writer = await asyncio.open_connection(ROBOT, target, local_addr=(DRIVER, 0))
            for one, other, to_robot in ((reader, far_writer, True), (far_reader, writer, False)):
                self._tasks.add(asyncio.ensure_future(self._pass(one, other, to_robot)))

        self._server = await asyncio.start_server(accept, ROBOT, port)

    async def close(self) -> None:
        self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, to_robot: bool) -> None:
        try:
            while data := await reader.read(1 << 16):
                if to_robot and self._seen and not self._seen.done() and all(part in data for part in self._wanted):
                    self._seen.set_result(time.perf_counter())
                writer.write(data)
        except ConnectionError:
            pass
        writer.close()

    async def until(self, wanted: tuple[bytes, ...], send: Callable[[], None]) -> float:
        """Return the ms from ``send`` until a message with all of ``wanted`` goes to the robot."""
        self._wanted, self._seen = wanted, asyncio.get_running_loop().create_future()
        start = time.perf_counter()
        send()
        async with asyncio.timeout(PATIENCE):
            return (await self._seen - start) * 1000


async def text_latency(relay: Relay, host: str, port: int) -> float:
    """Median ms of `chassis speed` from the text protocol's client at ``host`` to the robot."""
    reader, writer = await asyncio.open_connection(host, port, local_addr=(CLIENT, 0))
    writer.write(b"command;")
    await reader.readuntil(b";")
    taken = []
    for number in range(ROUNDS):
        speed = 0.1 if number % 2 else -0.1
        wanted = f"chassis speed x {speed:g}".encode()
        taken.append(await relay.until((wanted,), partial(writer.write, wanted + b" y 0 z 0;")))
        await reader.readuntil(b";")
        await asyncio.sleep(0.03)
    writer.write(b"quit;")
    await asyncio.sleep(0.5)
    writer.close()
    return statistics.median(taken)


async def rest_latency(relay: Relay, host: str, port: int) -> float:
    """Median ms of MoveBy from the REST client at ``host`` to the robot."""
    reader, writer = await asyncio.open_connection(host, port, local_addr=(CLIENT, 0))
    taken = []
    for number in range(ROUNDS):
        direction = f'"direction":{number % 2}'.encode()
        body = b'{"action_name":"slamtec.agent.actions.MoveByAction","options":{%s,"duration":300}}' % direction
        head = b"POST /api/core/motion/v1/actions HTTP/1.1\r\nhost: localhost\r\ncontent-length: %d\r\n\r\n" % len(body)
        taken.append(await relay.until((b"/actions ", direction), partial(writer.write, head + body)))
        answer = await reader.readuntil(b"\r\n\r\n")
        length = int(answer.lower().partition(b"content-length: ")[2].split(b"\r")[0])
        await reader.readexactly(length)
        await asyncio.sleep(0.03)
    writer.close()
    return statistics.median(taken)


class Dog:
    """A simulated dog behind its door, in this process; records the velocities of its base with their times."""

    def __init__(self, data: Path) -> None:
        self._runtime = Runtime(Config(world="empty", robots=(RobotConfig("a", "cyberdog2", DOG),), data=data))
        base = self._runtime.fleet.robots["a"][Base]
        self._command = base.set_velocity
        base.set_velocity = self._hear  # type: ignore[method-assign]
        self._wanted, self._seen = 0.0, asyncio.get_running_loop().create_future()

    async def __aenter__(self) -> Dog:
        await self._runtime.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._runtime.close()

    def _hear(self, twist: Twist) -> None:
        self._command(twist)
        if twist.x * self._wanted > 0 and not self._seen.done():
            self._seen.set_result(time.perf_counter())

    async def latency(self, send: Callable[[float], Awaitable[object]]) -> float:
        """Median ms from a velocity that is sent to the dog's base."""
        taken = []
        for number in range(ROUNDS):
            self._wanted = 0.1 if number % 2 else -0.1
            self._seen = asyncio.get_running_loop().create_future()
            begun = time.perf_counter()
            sending = asyncio.ensure_future(send(self._wanted))
            async with asyncio.timeout(PATIENCE):
                taken.append((await self._seen - begun) * 1000)
                await sending
            await asyncio.sleep(0.06)
        return statistics.median(taken)


async def measure_dog(claims: Claims, folder: Path) -> None:
    data = folder / "dog"
    certificates = data / "cyberdog" / "tls"
    async with Dog(data) as dog:
        async with CyberDogClient(DOG, Certificates.load(certificates), app_port=None) as client:
            await client.stand()
            direct = await dog.latency(lambda x: client.servo_frame(Motion.TROT_SLOW, x, 0.0, 0.0))
            await client.end_servo()
        print(f"cyberdog: one frame from a client takes {direct:.2f} ms", flush=True)
        url = f"cyberdog://{DOG}?certs={certificates}"
        front = served(folder / "front dog", "--world", "empty", "--robot", f"a={url}", address=FRONT)
        await asyncio.to_thread(front.__enter__)
        try:
            await asyncio.sleep(8)
            reader, writer = await asyncio.open_connection(FRONT, 40923, local_addr=(CLIENT, 0))
            writer.write(b"command;")
            await reader.readuntil(b";")

            async def say(x: float) -> None:
                writer.write(b"chassis speed x %.1f y 0 z 0;" % x)
                await reader.readuntil(b";")

            claims.at_most("cyberdog: added to a command", await dog.latency(say) - direct, 3.0, "ms")
            writer.close()
        finally:
            await asyncio.to_thread(front.__exit__, None, None, None)


class Inbox(asyncio.DatagramProtocol):
    def __init__(self) -> None:
        self.texts: list[bytes] = []

    def datagram_received(self, data: bytes, _addr: object) -> None:
        self.texts.append(data)


async def pushes(host: str) -> tuple[int, float]:
    """Number of attitude-and-position pushes in PUSH_SECONDS at 50 Hz while it drives; the share with new values."""
    loop = asyncio.get_running_loop()
    _, inbox = await loop.create_datagram_endpoint(Inbox, local_addr=(CLIENT, 40924))
    reader, writer = await asyncio.open_connection(host, 40923, local_addr=(CLIENT, 0))
    for command in (b"command;", b"chassis push position on freq 50;", b"chassis speed x 0 y 0 z 30;"):
        writer.write(command)
        await reader.readuntil(b";")
    writer.write(b"chassis speed x 0.1 y 0 z 30;")
    await asyncio.sleep(1)
    inbox.texts.clear()
    await asyncio.sleep(PUSH_SECONDS)
    texts = list(inbox.texts)
    writer.close()
    return len(texts), len(set(texts)) / max(len(texts), 1)


async def measure(claims: Claims) -> None:
    with tempfile.TemporaryDirectory() as folder, served(Path(folder) / "robot", "--world", "empty", address=ROBOT):
        for scheme, latency in (("robomaster", text_latency), ("slamware", rest_latency)):
            target, port = RELAYED[scheme]
            relay = Relay()
            await relay.open(target, port)
            direct = await latency(relay, ROBOT, port)
            print(f"{scheme}: the loopback alone takes {direct:.2f} ms", flush=True)
            await asyncio.sleep(1)
            url = f"{scheme}://{ROBOT}:{port}" + (f"?local={DRIVER}&drive=speed" if scheme == "robomaster" else "")
            front = served(Path(folder) / f"front {scheme}", "--world", "empty", "--robot", f"a={url}", address=FRONT)
            await asyncio.to_thread(front.__enter__)  # meanwhile the driver connects through this loop's relay
            try:
                await asyncio.sleep(6)
                claims.at_most(f"{scheme}: added to a command", await latency(relay, FRONT, target) - direct, 3.0, "ms")
                if scheme == "robomaster":
                    count, news = await pushes(FRONT)
                    claims.at_least("pushes of 50 Hz that arrive", count / (50 * PUSH_SECONDS) * 100, 99.5, "%")
                    print(f"{news:.0%} of them tell something new", flush=True)
            finally:
                await asyncio.to_thread(front.__exit__, None, None, None)
                await relay.close()
    with tempfile.TemporaryDirectory() as folder:
        await measure_dog(claims, Path(folder))


def main() -> None:
    claims = Claims()
    asyncio.run(measure(claims))
    claims.finish()


if __name__ == "__main__":
    main()
