"""Claim: 200 long streams of tasks open at once in one process; an app that answers no push never blocks the robot.

A dog does one task (6004) and one update (5010) at a time; a client that joins one takes its stream over. So the 200
streams are those of 100 dogs in one process, each of which maps and downloads. Then a single dog gets 200 streams: its
two, and bluetooth scans, of which it may run any number. At last, an app accepts heartbeats and leaves every push
unanswered while a dog maps: measured are how long other clients wait for an answer, and by how much the process grows,
compared with the same without an app.
"""

from __future__ import annotations

import asyncio
import json
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import grpc
from _claim import Claims
from cyberdog import GEAR, wait_until_idle

from roboglot.clients.cyberdog import Certificates
from roboglot.testing.process import ServedRobot, served
from roboglot.wire.cyberdog.channel import ROBOT_NAME, client_options
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service

ALONE, CROWD = "127.0.0.184", "127.0.84"  # one dog; the hundred apps' network
DOGS = 100
APP_PORT = 18984
STREAMS = 200
SECONDS = 12.0  # s without an answer from the app: four times the deadline of a push
OPEN = 5.0  # s that streams stay open before they are counted
EVERY = 0.02  # s between two requests of another client
WAIT_MAX, PART_MAX = 60.0, 180.0  # s: for one step, for a part
SCAN = (8001, {"scan_seconds": 8.0})
MAPPING, STOP = (6004, {"type": 5}), (6009, {"type": 5})
FILE = {"md5": "0" * 32, "fileSize": 4 * 1024**3}  # takes more than three minutes to download
UPDATE = (5010, {"operate": "download", "data": {"module": "x", "latest": {"version": "9", "packages": [FILE]}}})


class DeafApp(service.GrpcAppServicer):  # type: ignore[misc]
    """Lives, and answers no push until it hears again."""

    def __init__(self) -> None:
        self.pushed: dict[int, int] = {}
        self.hears = asyncio.Event()

    async def heartbeat(self, _request: Any, _context: Any) -> Any:
        return pb.Result(result="ok")

    async def sendMsg(self, request: Any, _context: Any) -> None:  # noqa: N802
        self.pushed[request.nameCode] = self.pushed.get(request.nameCode, 0) + 1
        await self.hears.wait()


@asynccontextmanager
async def stub_of(address: str, proof: Certificates) -> AsyncIterator[Any]:
    """Calls to one of the dogs."""
    credentials = grpc.ssl_channel_credentials(proof.ca, proof.key, proof.certificate)
    async with grpc.aio.secure_channel(f"{address}:50052", credentials, options=client_options(ROBOT_NAME)) as channel:
        yield service.GrpcAppStub(channel)


def call(stub: Any, what: tuple[int, object]) -> Any:
    return stub.sendMsg(pb.SendRequest(nameCode=what[0], params=json.dumps(what[1])))


async def finished(stub: Any, what: tuple[int, object]) -> str:
    """Return the last answer."""
    last = ""
    async with asyncio.timeout(WAIT_MAX):
        async for answer in call(stub, what):
            last = answer.data
    return last


class Reading:
    """One stream that is read as long as it is open."""

    def __init__(self, stub: Any, what: tuple[int, object]) -> None:
        self.answers: list[Any] = []
        self._call = call(stub, what)
        self._task = asyncio.ensure_future(self._read())

    async def _read(self) -> None:
        async for answer in self._call:
            self.answers.append(json.loads(answer.data))

    @property
    def runs(self) -> bool:
        """True if it was accepted and has not ended."""
        return self.answers[:1] == [{"accepted": 1}] and not self._task.done()

    @property
    def open(self) -> bool:
        return not self._task.done()

    async def close(self) -> None:
        self._call.cancel()
        await asyncio.wait([self._task], timeout=WAIT_MAX)


async def held(readings: list[Reading], stub: Any, counted: Callable[[Reading], bool], what: str) -> int:
    """Return the number of ``counted`` streams after a while, and the time of a request among them."""
    await asyncio.sleep(OPEN)
    began = time.perf_counter()
    await finished(stub, (GEAR, {}))
    took = 1000 * (time.perf_counter() - began)
    count = sum(map(counted, readings))
    print(f"{what}: {count} of {len(readings)} streams open; a request between them took {took:.1f} ms")
    async with asyncio.timeout(WAIT_MAX):
        await asyncio.gather(*(reading.close() for reading in readings))
    return count


async def crowd(_: ServedRobot, proof: Certificates, claims: Claims) -> None:
    """Each dog maps and downloads."""
    async with AsyncExitStack() as stack:
        stubs = [await stack.enter_async_context(stub_of(at(number), proof)) for number in range(DOGS)]
        readings = [Reading(stub, what) for stub in stubs for what in (MAPPING, UPDATE)]
        async with asyncio.timeout(WAIT_MAX):
            while not all(reading.answers for reading in readings):  # noqa: ASYNC110 - until all are accepted
                await asyncio.sleep(0.1)
        count = await held(readings, stubs[0], lambda reading: reading.runs, f"{DOGS} dogs")
        feedback = sum(len(reading.answers) - 1 for reading in readings)
        print(f"feedback that came meanwhile: {feedback}")
        claims.at_least("streams of tasks open at once", count, STREAMS, "streams")


async def alone(robot: ServedRobot, proof: Certificates, claims: Claims) -> None:
    """One dog: its two tasks among scans; then the deaf app."""
    async with stub_of(ALONE, proof) as stub:
        readings = [Reading(stub, what) for what in (MAPPING, UPDATE, *(STREAMS - 2) * (SCAN,))]
        count = await held(readings, stub, lambda reading: reading.open, "one dog")
        claims.at_least("long streams at one dog", count, STREAMS, "streams")
        await finished(stub, STOP)
        await deaf_app(robot, proof, stub, claims)


async def waits(stub: Any) -> float:
    """s that 99 of 100 requests wait at most."""
    took, end = [], time.perf_counter() + SECONDS
    while time.perf_counter() < end:
        began = time.perf_counter()
        await finished(stub, (GEAR, {}))
        took.append(time.perf_counter() - began)
        await asyncio.sleep(EVERY)
    return sorted(took)[int(0.99 * len(took))]


async def deaf_app(robot: ServedRobot, proof: Certificates, stub: Any, claims: Claims) -> None:
    """The dog maps, without an app and with one that answers no push."""
    mapping = Reading(stub, MAPPING)
    without = await waits(stub)
    app, server = DeafApp(), grpc.aio.server(options=[("grpc.so_reuseport", 0)])
    service.add_GrpcAppServicer_to_server(app, server)
    pair = ((proof.key, proof.certificate),)
    credentials = grpc.ssl_server_credentials(pair, proof.ca, require_client_auth=True)
    server.add_secure_port(f"127.0.0.1:{APP_PORT}", credentials)
    await server.start()
    try:
        async with asyncio.timeout(WAIT_MAX):
            while not app.pushed:
                await finished(stub, (GEAR, {}))
                await asyncio.sleep(0.2)
        before = robot.resident_megabytes
        slow = await waits(stub)
        grown = robot.resident_megabytes - before
    finally:
        app.hears.set()
        await server.stop(1.0)
    print(f"99 of 100 requests within {1000 * without:.1f} ms without an app, {1000 * slow:.1f} ms with a deaf one")
    print(f"pushes that it left unanswered, by code: {app.pushed}; mapping went on: {mapping.runs}")
    claims.at_most("p99 of others at a deaf app", 1000 * slow, 50.0, "ms")
    claims.at_most("growth by a deaf app", max(0.1, grown), 20.0, "MB")
    await mapping.close()
    await finished(stub, STOP)


def at(number: int) -> str:
    """Return the address of one of the hundred."""
    return f"{CROWD}.{number + 1}"


def part(
    run: Callable[[ServedRobot, Certificates, Claims], Coroutine[Any, Any, None]],
    claims: Claims,
    address: str,
    *arguments: str,
) -> None:
    """Measure one ``roboglot up`` with these arguments."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        with served(data, *arguments, address=address) as robot:
            wait_until_idle(robot)
            proof = Certificates.load(data / "cyberdog" / "tls")
            asyncio.run(asyncio.wait_for(run(robot, proof, claims), PART_MAX))


def main() -> None:
    claims = Claims()
    others = (word for number in range(1, DOGS) for word in ("--robot", f"d{number}=cyberdog2@{at(number)}"))
    part(crowd, claims, at(0), "--robot", "a=cyberdog2", *others, "--world", "office")
    app = f"127.0.0.1:{APP_PORT}"
    part(alone, claims, ALONE, "--robot", "a=cyberdog2", "--world", "playground", "--app", app)
    claims.finish()


if __name__ == "__main__":
    main()
