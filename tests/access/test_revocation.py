"""A right that is taken away is gone on open connections, too, and what its client has the robot do stops."""

from __future__ import annotations

import asyncio
import json
import random
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import grpc
import httpx
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from roboglot.access.store import AccessStore, Grant, open_store
from roboglot.model.clock import LockstepClock
from roboglot.protocols.cyberdog.certificates import export_app
from roboglot.runtime import Runtime
from roboglot.wire.cyberdog.channel import ROBOT_NAME
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto.cyberdog_app_pb2_grpc import GrpcAppStub
from tests.access.matrix import ADDRESS, CALLERS, TextCaller, frame_states, open_frames

DRIVER = next(caller for caller in CALLERS if caller.name == "drive")
PROGRAMMER = next(caller for caller in CALLERS if caller.name == "program")
Gone = Callable[[], Awaitable[bool]]
Way = Callable[[Runtime, Path], AbstractAsyncContextManager[tuple[str, Gone]]]
LASTS = 3600.0  # s for which a right is given


@asynccontextmanager
async def by_rest(runtime: Runtime, data: Path) -> AsyncIterator[tuple[str, Gone]]:
    """Yield a goal far away."""
    transport = httpx.AsyncHTTPTransport(local_address=DRIVER.address, verify=False)
    go = {"action_name": "slamtec.agent.actions.MoveToAction", "options": {"target": {"x": 3.0, "y": 0.0}}}
    async with httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", transport=transport) as client:
        assert (await client.post("/api/core/motion/v1/actions", json=go)).status_code == 200

        async def gone() -> bool:
            try:
                return (await client.post("/api/core/motion/v1/actions", json=go)).status_code in (401, 403)
            except httpx.TransportError:  # the connection was closed
                return False

        yield DRIVER.address, gone


@asynccontextmanager
async def by_text(runtime: Runtime, data: Path) -> AsyncIterator[tuple[str, Gone]]:
    """Yield a speed."""
    client = await TextCaller.open(DRIVER.address)
    assert [await client.ask(text) for text in ("command", "chassis speed x 0.3")] == [b"ok;", b"ok;"]

    async def gone() -> bool:
        return await client.ask("chassis speed x 0.3") == b""

    yield DRIVER.address, gone
    client.close()


@asynccontextmanager
async def by_gait(runtime: Runtime, data: Path) -> AsyncIterator[tuple[str, Gone]]:
    """Yield a walk of the dog that takes a while."""
    ca, certificate, key = (path.read_bytes() for path in export_app(data / "cyberdog", "drive", data / "phone"))
    credentials = grpc.ssl_channel_credentials(ca, key, certificate)
    options = [("grpc.ssl_target_name_override", ROBOT_NAME)]
    async with grpc.aio.secure_channel(f"{ADDRESS}:50052", credentials, options=options) as channel:
        stub = GrpcAppStub(channel)

        async def ask(code: int, params: object) -> list[dict[str, object]]:
            stream = stub.sendMsg(pb.SendRequest(nameCode=code, params=json.dumps(params)), timeout=60.0)
            return [json.loads(message.data) async for message in stream if message.data.startswith("{")]

        walk = {"motion_id": 303, "cmd_source": 0, "vel_des": [0.2, 0.0, 0.0], "duration": 8000}
        motion = asyncio.ensure_future(ask(1004, walk))

        async def gone() -> bool:
            await motion
            return all(answer.get("error_code", 0) for answer in await ask(1004, {"motion_id": 111}))

        yield "drive", gone


@asynccontextmanager
async def by_program(runtime: Runtime, data: Path) -> AsyncIterator[tuple[str, Gone]]:
    """Yield a program that never ends."""
    link = await open_frames(PROGRAMMER.address)
    assert link is not None
    frame = {"type": "task", "operate": "debug", "target_id": ["debug"], "mode": "single", "condition": "now"}
    walk = "cyberdog.motion.go_straight(x_velocity=0.2, distance=1.0)"
    body = f"cyberdog.motion.resume_standing()\nwhile True:\n    {walk}\n"
    [(state, words)] = await frame_states(link, [{**frame, "body": body}])
    assert not state, words

    async def gone() -> bool:
        async for _ in link:
            pass
        return await open_frames(PROGRAMMER.address) is None

    yield PROGRAMMER.address, gone
    await link.close()


@asynccontextmanager
async def by_hand(runtime: Runtime, data: Path) -> AsyncIterator[tuple[str, Gone]]:
    """Yield the console's pad, held."""
    assert runtime.console is not None
    await runtime.console.ready()
    async with connect(f"ws://127.0.0.1:{runtime.console.port}/live", local_addr=(DRIVER.address, 0)) as page:
        driving = asyncio.ensure_future(hold(page))

        async def gone() -> bool:
            await driving
            return page.close_code is not None

        yield DRIVER.address, gone


async def hold(page: ClientConnection) -> None:
    """Drive until the page is closed."""
    number = 0
    try:
        async for text in page:
            number += 1
            now = json.loads(text).get("now", 0.0) if isinstance(text, str) else 0.0
            if now:
                velocity = {"type": "drive", "robot": "a", "seq": number, "stamp": now, "x": 0.2}
                await page.send(json.dumps(velocity))
    except ConnectionClosed:
        pass


WAYS: list[Way] = [by_rest, by_text, by_gait, by_program, by_hand]


@pytest.mark.parametrize("way", WAYS)
async def test_actions_of_a_revoked_client_stop(way: Way, runtime: Runtime, store: AccessStore, data: Path) -> None:
    await check_it_stops(way, revoke, runtime, data)


@pytest.mark.parametrize(
    "way", [by_gait, *(pytest.param(way, marks=pytest.mark.slow) for way in WAYS if way != by_gait)]
)
async def test_actions_of_a_client_whose_right_expires_stop(
    way: Way, runtime: Runtime, store: AccessStore, data: Path
) -> None:
    until = time.time() + LASTS
    store.allow(DRIVER.address, [Grant("a", DRIVER.rights, until)])
    store.allow(PROGRAMMER.address, [Grant("a", PROGRAMMER.rights, until)])
    store.add_app("drive", [Grant("a", DRIVER.rights, until)])
    await check_it_stops(way, expire, runtime, data)


@pytest.mark.slow  # further moments; the tests above have one each
@pytest.mark.parametrize("seed", range(15))
async def test_right_that_ends_at_any_moment(seed: int, runtime: Runtime, store: AccessStore, data: Path) -> None:
    draw = random.Random(seed)
    await check_it_stops(
        WAYS[seed % len(WAYS)], revoke, runtime, data, later=draw.choice([0.02, 0.3, draw.uniform(0, 6)])
    )


def revoke(_: Runtime, data: Path, who: str) -> None:
    other = open_store(data)  # as `roboglot access revoke` does in its own process
    other.revoke(who)
    other.close()


def expire(runtime: Runtime, _: Path, __: str) -> None:
    assert runtime.guard is not None
    runtime.guard.now = lambda: time.time() + 2 * LASTS


async def check_it_stops(
    way: Way, end: Callable[[Runtime, Path, str], None], runtime: Runtime, data: Path, *, later: float = 0.0
) -> None:
    """Assert that what a client has the robot do stops with its right, which ends ``later`` s after it began."""
    clock, robot = runtime.clock, runtime.fleet.robots["a"]
    assert isinstance(clock, LockstepClock)
    async with way(runtime, data) as (who, gone), asyncio.timeout(60.0):
        while not any(action.identity == who for action in robot.actions.running()):
            await clock.advance(0.05)
            await asyncio.sleep(0.005)
        while later > 0.0:
            await clock.advance(min(0.05, later))
            await asyncio.sleep(0.005)
            later -= 0.05
        end(runtime, data, who)
        closing = asyncio.ensure_future(until(gone))
        while robot.actions.running() or not closing.done():
            await clock.advance(0.05)
            await asyncio.sleep(0.005)
        await closing
        await clock.advance(1.0)
        assert not robot.actions.running()


async def until(gone: Gone) -> None:
    """The list is looked at four times a second."""
    while not await gone():  # noqa: ASYNC110
        await asyncio.sleep(0.02)
