"""Actions to wait for, maps as arrays, and what happens when the robot does not answer as it should."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable

import numpy as np
import pytest

from roboglot.clients.errors import BadAnswer, LinkLost, TimedOut
from roboglot.clients.slamware import ActionAborted, ActionFailed, SlamwareClient, SlamwareRefused, http
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose
from roboglot.wire.slamware.chapters.motion import (
    ActionInfo,
    AngleOptions,
    Direction,
    MoveByOptions,
    MoveOptions,
    MoveToOptions,
)
from roboglot.wire.slamware.chapters.slam.stcm import MAP_BYTES_MAX
from roboglot.wire.slamware.geometry import Location

Reply = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


async def test_an_action_is_awaited_with_progress(
    client: SlamwareClient, robot: Robot, world: World, forward: Forward
) -> None:
    await forward(seconds=2)
    start = world.truth.pose_of("a")
    seen: list[ActionInfo] = []
    options = MoveToOptions(Location(1.0, 0.5), MoveOptions(flags=["with_yaw", "precise"], yaw=1.0))
    action = await client.begin("MoveToAction", options, seen.append)
    waiting = asyncio.ensure_future(action.succeeded())
    while not waiting.done():
        await forward(seconds=0.5)
    await waiting
    assert_pose(world.truth.pose_of("a").relative_to(start), x=1.0, y=0.5, deg=57.3, within=0.1, within_deg=3)
    assert {info.stage for info in seen} >= {"GOING_TO_TARGET"}
    assert seen[0].action_name.endswith(".MoveToAction")


async def test_cancelled_action_and_failed_one_raise_robots_reason(client: SlamwareClient, forward: Forward) -> None:
    await forward(seconds=2)
    action = await client.begin("RotateAction", AngleOptions(3.0))
    await forward(seconds=0.5)
    assert await action.cancel()
    waiting = asyncio.ensure_future(action.succeeded())
    await forward(seconds=3)
    with pytest.raises(ActionAborted):
        await waiting
    assert not await action.cancel()  # the robot has given it away
    blocked = await client.begin("MoveToAction", MoveToOptions(Location(500.0, 500.0)))
    waiting = asyncio.ensure_future(blocked.succeeded())
    await forward(seconds=5)
    with pytest.raises(ActionFailed, match="CANNOT_REACH_TARGET"):
        await waiting


async def test_only_ones_own_action_is_cancelled(client: SlamwareClient, forward: Forward) -> None:
    await forward(seconds=1)
    mine = await client.begin("RotateAction", AngleOptions(1.0))
    others = await client.begin("MoveByAction", MoveByOptions(Direction.FORWARD, duration=3000))
    assert not await mine.cancel()
    await forward(seconds=0.5)
    assert (await client.get_current_action()).action_id == others.id


async def test_map_is_array_and_composite_map_round_trips(
    client: SlamwareClient, robot: Robot, forward: Forward
) -> None:
    await forward(seconds=2)
    explored, grid = await client.get_explore_map(), robot[Mapping].grid
    np.testing.assert_array_equal(explored.cells, -grid.log_odds)
    drawn = await client.get_composite_map()
    await client.set_composite_map(drawn)
    await forward(seconds=2)
    assert (await client.get_explore_map()).cells.shape == explored.cells.shape


async def test_the_scan_as_arrays(client: SlamwareClient, forward: Forward) -> None:
    await forward(seconds=1)
    angles, distances = (await client.get_laser_scan()).arrays()
    assert len(angles) == len(distances) > 300
    assert 0 < distances.min() < 20


async def test_a_refusal_carries_status_and_words(client: SlamwareClient) -> None:
    with pytest.raises(SlamwareRefused, match="no dock") as refused:
        await client.erase_home_dock("nowhere")
    assert (refused.value.code, refused.value.operation) == (404, "DELETE /api/core/slam/v1/homedocks/{dock_id}")


async def test_many_questions_share_few_connections(door: SlamwareDoor, client: SlamwareClient) -> None:
    await asyncio.gather(*(client.get_power_status() for _ in range(50)))
    assert door._connections is not None
    assert len(door._connections.open) <= 6


@pytest.fixture
async def fake() -> AsyncIterator[Callable[[Reply], Awaitable[SlamwareClient]]]:
    """A client of a robot that answers as the test says."""
    opened: list[tuple[asyncio.Server, SlamwareClient]] = []

    async def serve(reply: Reply) -> SlamwareClient:
        async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            try:
                await reply(reader, writer)
            finally:
                writer.close()

        server = await asyncio.start_server(talk, "127.0.0.1", 0)
        client = SlamwareClient("127.0.0.1", server.sockets[0].getsockname()[1], timeout=0.2)
        opened.append((server, client))
        return client

    yield serve
    for server, client in opened:
        client.close()
        server.close()


def answering(data: bytes) -> Reply:
    """Reads a request and says ``data``."""

    async def reply(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(data)
        await writer.drain()

    return reply


JSON = b"HTTP/1.1 200 OK\r\ncontent-length: %d\r\n\r\n%s"


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (b"", LinkLost),
        (b"garbage\r\n\r\n", BadAnswer),
        (JSON % (3, b"{1]"), BadAnswer),
        (JSON % (12, b'{"x": "no" }'), BadAnswer),
        (JSON % (200, b'{"x": 1.0'), LinkLost),
        (b"HTTP/1.1 200 OK\r\nx: " + b"y" * 40_000 + b"\r\n\r\n", BadAnswer),
    ],
)
async def test_bad_answers_are_reported_and_nothing_hangs(
    fake: Callable[[Reply], Awaitable[SlamwareClient]], data: bytes, error: type[Exception]
) -> None:
    client = await fake(answering(data))
    with pytest.raises(error):
        await client.get_pose()


POSE = b'{"x": 1.0, "y": 2.0, "z": 0.0, "yaw": 0.5, "pitch": 0.0, "roll": 0.0}'
CHUNKED = b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n%x\r\n%s\r\n0\r\n\r\n"


@pytest.mark.parametrize(
    "data",
    [
        b"HTTP/1.0 200 OK\r\n\r\n" + POSE,  # its end is that of the connection
        b"HTTP/1.1 200\r\nconnection: close\r\n\r\n" + POSE,
        CHUNKED % (len(POSE), POSE),
        b"HTTP/1.1 102 Processing\r\n\r\n" + JSON % (len(POSE), POSE),
    ],
)
async def test_answers_of_every_length_are_read(
    fake: Callable[[Reply], Awaitable[SlamwareClient]], data: bytes
) -> None:
    client = await fake(answering(data))
    for _ in range(2):
        assert (await client.get_pose()).x == 1.0


@pytest.mark.parametrize("method", ["HEAD", "CONNECT", "DO IT", "", "\t"])
async def test_any_method_of_a_recording_is_sent(
    fake: Callable[[Reply], Awaitable[SlamwareClient]], method: str
) -> None:
    """The robot refuses what is no method, not the client."""
    body = b"" if method == "HEAD" else POSE
    client = await fake(answering(b"HTTP/1.1 400 No\r\ncontent-length: %d\r\n\r\n%s" % (len(POSE), body)))
    answer = await client._link.ask(method, "/x", b"", "", 60.0)
    assert (answer.status, answer.reason, bytes(answer.body)) == (400, "No", body)


async def test_more_than_was_asked_for_ends_the_connection(
    fake: Callable[[Reply], Awaitable[SlamwareClient]],
) -> None:
    """It is no answer to the next request."""
    other = POSE.replace(b"1.0", b"7.0")
    client = await fake(answering(JSON % (len(POSE), POSE) + JSON % (len(other), other)))
    for _ in range(2):
        assert (await client.get_pose()).x == 1.0


async def test_unlisted_flags_of_a_robot_are_read(fake: Callable[[Reply], Awaitable[SlamwareClient]]) -> None:
    data = b'{"mode": 0, "flags": ["with_yaw", "fast", null], "yaw": 1.5}'
    client = await fake(answering(JSON % (len(data), data)))
    options = await client.get_move_options()
    assert (options.flags, options.yaw) == (["with_yaw", "fast", None], 1.5)


async def test_an_answer_is_no_longer_than_map(
    fake: Callable[[Reply], Awaitable[SlamwareClient]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six answers are kept at once, and a hostile robot's have no end."""
    assert http.BODY_MAX == MAP_BYTES_MAX
    monkeypatch.setattr(http, "BODY_MAX", 1000)
    client = await fake(answering(JSON % (1 << 40, b" " * 1001)))
    with pytest.raises(BadAnswer, match="more than 1000 bytes"):
        await client.get_pose()


async def test_silence_is_timeout_and_absence_a_lost_link(
    fake: Callable[[Reply], Awaitable[SlamwareClient]],
) -> None:
    async def silent(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read()

    with pytest.raises(TimedOut):
        await (await fake(silent)).get_pose()
    async with SlamwareClient("127.0.0.1", 1) as no_one:
        with pytest.raises(LinkLost, match="cannot be reached"):
            await no_one.get_pose()


async def test_questions_but_never_commands_are_repeated_on_reconnection(
    fake: Callable[[Reply], Awaitable[SlamwareClient]],
) -> None:
    asked: list[bytes] = []

    async def once_each(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        asked.append((await reader.readuntil(b"\r\n\r\n"))[:4])
        writer.write(JSON % (1, b"1"))
        asked.append((await reader.readuntil(b"\r\n\r\n"))[:4])  # then hang up without a reply

    client = await fake(once_each)
    assert [await client.get_localization_quality() for _ in range(2)] == [1, 1]
    assert asked == [b"GET "] * 3
    with pytest.raises(LinkLost):
        await client.hibernate()
    assert asked[3:] == [b"POST"]
