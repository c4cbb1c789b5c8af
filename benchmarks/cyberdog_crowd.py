"""Claim: 200 long streams open at once in one process; an app that answers no push never blocks the robot.

Three dogs in one process run what a dog may run once (mapping, following, navigation) beside bluetooth scans, of which
it may run any number. Then an app takes heartbeats and leaves every push unanswered while its dog maps: how long others
wait for an answer meanwhile, and what the process grows by. The same figures without an app stand beside it.
"""

from __future__ import annotations

import asyncio
import json
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
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

DOGS = {"a": "127.0.0.184", "b": "127.0.0.185", "c": "127.0.0.186"}
APP_PORT = 18984
STREAMS = 200
SECONDS = 12.0  # that the app answers nothing: four times the deadline of a push
EVERY = 0.02  # s between two requests of somebody else
SCAN = (8001, {"scan_seconds": 8.0})
MAPPING, FOLLOWING, FINDING = (6004, {"type": 5}), (6004, {"type": 13}), (6004, {"type": 7})
GOING = (6004, {"type": 1, "goalX": 2.5, "goalY": 0.0})


class DeafApp(service.GrpcAppServicer):  # type: ignore[misc]
    """Lives, and answers no push."""

    def __init__(self) -> None:
        self.pushed: dict[int, int] = {}

    async def heartbeat(self, request: Any, context: Any) -> Any:
        return pb.Result(result="ok")

    async def sendMsg(self, request: Any, context: Any) -> None:  # noqa: N802
        self.pushed[request.nameCode] = self.pushed.get(request.nameCode, 0) + 1
        await asyncio.Event().wait()


@asynccontextmanager
async def stub_of(address: str, proof: Certificates) -> AsyncIterator[Any]:
    """Calls to one of the dogs."""
    credentials = grpc.ssl_channel_credentials(proof.ca, proof.key, proof.certificate)
    async with grpc.aio.secure_channel(f"{address}:50052", credentials, options=client_options(ROBOT_NAME)) as channel:
        yield service.GrpcAppStub(channel)


def call(stub: Any, what: tuple[int, object]) -> Any:
    return stub.sendMsg(pb.SendRequest(nameCode=what[0], params=json.dumps(what[1])))


async def finished(stub: Any, what: tuple[int, object]) -> str:
    """The last answer."""
    last = ""
    async for answer in call(stub, what):
        last = answer.data
    return last


async def streams(stubs: dict[str, Any]) -> int:
    """How many are open at once, a second after they were begun; and what a request takes between them."""
    found = await finished(stubs["c"], FINDING)
    tasks = [call(stubs["a"], MAPPING), call(stubs["b"], FOLLOWING), call(stubs["c"], GOING)]
    scans = [call(stubs[name], SCAN) for name in (list(DOGS) * STREAMS)[: STREAMS - len(tasks)]]
    accepted = [json.loads((await task.read()).data) for task in tasks]
    reading = [asyncio.ensure_future(scan.read()) for scan in scans]
    await asyncio.sleep(1.0)
    began = time.perf_counter()
    await finished(stubs["a"], (GEAR, {}))
    took = 1000 * (time.perf_counter() - began)
    open_now = sum(not one.done() for one in reading) + sum(not task.done() for task in tasks)
    print(f"tasks {accepted}, c was found {found}; a request between {open_now} open streams took {took:.1f} ms")
    for one in (*scans, *tasks):
        one.cancel()
    await asyncio.gather(*reading, return_exceptions=True)
    for name, type in (("a", 5), ("b", 13), ("c", 0)):
        await finished(stubs[name], (6009, {"type": type}))
    return open_now


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
    mapping = call(stub, MAPPING)
    await mapping.read()
    alone = await waits(stub)
    app, server = DeafApp(), grpc.aio.server(options=[("grpc.so_reuseport", 0)])
    service.add_GrpcAppServicer_to_server(app, server)
    pair = ((proof.key, proof.certificate),)
    credentials = grpc.ssl_server_credentials(pair, proof.ca, require_client_auth=True)
    server.add_secure_port(f"127.0.0.1:{APP_PORT}", credentials)
    await server.start()
    while not app.pushed:
        await finished(stub, (GEAR, {}))
        await asyncio.sleep(0.2)
    before = robot.resident_megabytes
    slow = await waits(stub)
    grown = robot.resident_megabytes - before
    await server.stop(None)
    print(f"99 of 100 requests within {1000 * alone:.1f} ms without an app, {1000 * slow:.1f} ms with a deaf one")
    print(f"pushes that it left unanswered, by code: {app.pushed}")
    claims.at_most("p99 of others at a deaf app", 1000 * slow, 50.0, "ms")
    claims.at_most("growth by a deaf app", max(0.1, grown), 20.0, "MB")
    mapping.cancel()
    await finished(stub, (6009, {"type": 5}))


async def run(robot: ServedRobot, data: Path, claims: Claims) -> None:
    """Both parts."""
    proof = Certificates.load(data / "cyberdog" / "tls")
    async with (
        stub_of(DOGS["a"], proof) as a,
        stub_of(DOGS["b"], proof) as b,
        stub_of(DOGS["c"], proof) as c,
    ):
        claims.at_least("long streams open at once", await streams({"a": a, "b": b, "c": c}), STREAMS, "streams")
        await deaf_app(robot, proof, a, claims)


def main() -> None:
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        arguments = [part for name, at in DOGS.items() for part in ("--robot", f"{name}=cyberdog2@{at}")]
        arguments += ["--world", "playground", "--app", f"127.0.0.1:{APP_PORT}"]
        with served(data, *arguments, address=DOGS["a"]) as robot:
            wait_until_idle(robot)
            asyncio.run(run(robot, data, claims))
    claims.finish()


if __name__ == "__main__":
    sys.exit(main())
