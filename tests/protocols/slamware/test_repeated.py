"""Requests that come again, byte for byte, are answered in place, and in no way other than the first one."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import AsyncIterator
from random import Random
from unittest.mock import patch

import pytest

from roboglot.model.components.mapping.places import Places
from roboglot.model.errors import Refused
from roboglot.model.inputs.fairness import Fairness
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.http_connection import REPEATED_MAX, HttpConnection
from roboglot.protocols.slamware.server import SlamwareDoor
from tests.protocols.held_fairness import until

PATIENCE = 60.0  # s of real time
API = "/api/core/artifact/v1/pois"


class Client:
    """A connection that sends given bytes."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self.writer = reader, writer

    def send(self, text: str) -> None:
        self.writer.write(text.encode())

    async def reply(self) -> bytes:
        async with asyncio.timeout(PATIENCE):
            head = await self._reader.readuntil(b"\r\n\r\n")
            length = int(head.partition(b"content-length: ")[2].partition(b"\r")[0])
            return head + await self._reader.readexactly(length)

    async def ask(self, text: str) -> bytes:
        self.send(text)
        return await self.reply()


def get(path: str = API, more: str = "") -> str:
    return f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{more}\r\n"


@pytest.fixture
async def wire(bare_door: SlamwareDoor) -> AsyncIterator[Client]:
    opened = Client(*await asyncio.open_connection("127.0.0.1", bare_door.port))
    yield opened
    opened.writer.close()


def connection(door: SlamwareDoor) -> HttpConnection:
    assert door._connections
    (only,) = door._connections.open
    return only


@pytest.mark.parametrize(
    "request_text", [get(), get("/api/core/system/v1/robot/info?x=1", "Origin: http://127.0.0.1\r\n")]
)
async def test_answer_is_the_first_byte_for_byte(wire: Client, bare_door: SlamwareDoor, request_text: str) -> None:
    replies = [await wire.ask(request_text) for _ in range(5)]
    assert len(set(replies)) == 1
    assert replies[0].startswith(b"HTTP/1.1 200 OK\r\n")
    assert list(connection(bare_door)._said) == [request_text.encode()]


async def test_answer_is_what_is_true_now(wire: Client, bare: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(3):
        assert (await wire.ask(get())).endswith(b"[]")

    def refuse(*_: object) -> None:
        raise Refused("the disk is gone")

    with monkeypatch.context() as patched:
        patched.setattr(type(bare[Places]), "all", refuse)
        assert b"the disk is gone" in await wire.ask(get())
    assert (await wire.ask(get())).endswith(b"[]")


async def test_answer_that_cannot_be_written_is_an_error(
    wire: Client, bare_door: SlamwareDoor, monkeypatch: pytest.MonkeyPatch
) -> None:
    for _ in range(3):
        await wire.ask(get())
    monkeypatch.setattr(bare_door._application, "_encode", lambda _: 1 / 0)
    assert (await wire.ask(get())).startswith(b"HTTP/1.1 500")


async def test_follower_sees_requests_made_before_it_came(wire: Client, bare: Robot) -> None:
    for _ in range(3):
        await wire.ask(get())
    seen: list[tuple[str, str]] = []
    leave = bare.tap.listen(lambda exchange: seen.append((exchange.direction, exchange.operation)))
    await wire.ask(get())
    await until(lambda: len(seen) == 2)
    leave()
    assert seen == [("request", f"GET {API}"), ("reply", f"GET {API}")]


async def test_half_a_request_is_no_repeated_one(wire: Client) -> None:
    for _ in range(3):
        await wire.ask(get())
    wire.send("GET /nowhere HTTP/1.1\r\nX: ")
    await asyncio.sleep(0.01)
    assert (await wire.ask(get())).startswith(b"HTTP/1.1 404")  # its first line is that header's value


async def test_other_requests_are_read_anew(wire: Client, bare_door: SlamwareDoor) -> None:
    for text in (
        get("/nowhere"),
        get().replace("GET", "OPTIONS"),
        f"DELETE {API}/1 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
    ):
        for _ in range(3):
            await wire.ask(text)
    assert not connection(bare_door)._said


async def test_number_of_known_requests_is_limited(wire: Client, bare_door: SlamwareDoor) -> None:
    for number in range(REPEATED_MAX + 2):
        for _ in range(2):
            await wire.ask(get(more=f"X: {number}\r\n"))
    assert 0 < len(connection(bare_door)._said) <= REPEATED_MAX


async def test_each_repeated_request_counts_in_the_share(wire: Client, bare: Robot) -> None:
    time = itertools.count()
    bare.fairness = fairness = Fairness(lambda: next(time) * 1e-6, lambda: 0.0)
    host, port = wire.writer.get_extra_info("sockname")
    use, used = fairness.of(f"{host}:{port}"), [0.0]
    for _ in range(6):
        await wire.ask(get())
        used.append(use.used)
    assert used == sorted(set(used))


async def test_request_of_each_window_needs_no_parser(wire: Client, bare: Robot, bare_door: SlamwareDoor) -> None:
    bare.fairness = fairness = Fairness(lambda: 0.0, lambda: 0.0)
    host, port = wire.writer.get_extra_info("sockname")
    for _ in range(3):
        await wire.ask(get())
    fairness.of(f"{host}:{port}").settle()  # as the next window does
    with patch.object(connection(bare_door), "parser", None):
        assert (await wire.ask(get())).endswith(b"[]")


async def test_client_that_repeats_itself_is_kept(wire: Client, bare_door: SlamwareDoor) -> None:
    for _ in range(3):
        await wire.ask(get())
    connection(bare_door).timeout_keep_alive_handler()  # set when the last request was read
    await wire.ask(get())
    connection(bare_door).timeout_keep_alive_handler()
    connection(bare_door).timeout_keep_alive_handler()
    async with asyncio.timeout(PATIENCE):
        assert await wire._reader.read() == b""


CHUNKED = "Transfer-Encoding: chunked\r\n"
STREAM = (
    get(),
    get("/api/core/system/v1/robot/info", "Accept: text/plain\r\n"),
    get("/nowhere"),
    get(more="Origin: http://evil.example\r\n"),
    get(more=CHUNKED) + "2\r\n{}\r\n0\r\nOrigin: http://evil.example\r\n\r\n",
    get(more="Connection: Upgrade\r\nUpgrade: h2c\r\n"),
    get().replace("GET", "OPTIONS"),
    get() + "\r\n",
)


@pytest.mark.parametrize("seed", range(4))
async def test_answers_do_not_depend_on_pieces(wire: Client, bare_door: SlamwareDoor, seed: int) -> None:
    random = Random(seed)
    requests = random.choices(random.sample(STREAM, 3), k=9)
    one_by_one = [await wire.ask(text) for text in requests]
    whole = "".join(requests) + get(more="Connection: close\r\n")
    for pieces in ([whole], whole, [whole[i : i + 37] for i in range(0, len(whole), 37)]):
        reader, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
        for piece in pieces:
            writer.write(piece.encode())
            await asyncio.sleep(0)
        answers = await asyncio.wait_for(reader.read(), PATIENCE)
        writer.close()
        assert answers.startswith(b"".join(one_by_one) + b"HTTP/1.1 200 ")
