"""The socket of a fleet's classes: what consoles send and leave unread is bounded, and stays within the folder."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from unittest.mock import AsyncMock, Mock

import pytest
import pytest_asyncio

from roboglot.console.studio import class_link
from roboglot.console.studio.class_link import Hello, LinkedRoom, LinkedSeat
from roboglot.model.errors import Refused
from roboglot.shards import classes
from roboglot.shards.classes import NAMELESS_MAX, FleetClasses

HELLO = {"type": "Hello", "world": "w1", "page": "http://127.0.0.1"}
SIGN_IN = {"type": "SignIn", "id": 1, "code": "none", "name": "Anna"}
Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]


@pytest_asyncio.fixture
async def fleet(tmp_path: Path) -> AsyncIterator[Path]:
    """The folder of a fleet with classes."""
    folder = tmp_path / "some" / "fleet"
    folder.mkdir(parents=True)
    served = FleetClasses(folder)
    await served.open()
    yield folder
    await served.close()


@asynccontextmanager
async def console(folder: Path, *messages: object) -> AsyncIterator[Streams]:
    reader, writer = await asyncio.open_unix_connection(folder / "class")
    writer.write(b"".join(json.dumps(message).encode() + b"\n" for message in messages))
    yield reader, writer
    writer.transport.abort()


async def is_served(folder: Path) -> bool:
    async with console(folder, HELLO, SIGN_IN) as (reader, _):
        return json.loads(await reader.readline())["type"] == "Admitted"


@pytest.mark.parametrize("code", ["../../escaped", "AB/../..", "abcdef", "ABCDEF\n", "A" * 300, "\0"])
async def test_codes_that_are_paths_are_refused(fleet: Path, code: str) -> None:
    opened = {"type": "Opened", "code": code, "name": "7b"}
    async with console(fleet, HELLO, opened) as (reader, _):
        assert await reader.read() == b""
    assert await is_served(fleet)
    assert not _written(fleet.parent.parent)


def _written(folder: Path) -> list[Path]:
    return list(folder.rglob("class.json"))


async def test_unread_answers_are_bounded(fleet: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(class_link, "UNREAD_MAX", 1 << 16)
    async with console(fleet, HELLO) as (reader, writer):
        for _ in range(100):
            writer.write((json.dumps(SIGN_IN).encode() + b"\n") * 200)
            await asyncio.sleep(0)
        with pytest.raises(ConnectionError):
            await _read_all(reader, 20_000)
    assert await is_served(fleet)


async def _read_all(reader: asyncio.StreamReader, lines: int) -> None:
    for _ in range(lines):
        if not await reader.readline():
            raise ConnectionError


async def test_consoles_without_a_name_are_bounded(fleet: Path) -> None:
    connections = [await asyncio.open_unix_connection(fleet / "class") for _ in range(NAMELESS_MAX + 1)]
    assert await connections[-1][0].read() == b""
    for _, writer in connections:
        writer.transport.abort()


async def test_names_that_do_not_come_are_not_awaited(fleet: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(classes, "NAMELESS_SECONDS", 0.0)
    async with console(fleet) as (reader, _):
        assert await reader.read() == b""


async def test_long_names_stay_out_of_the_log(fleet: Path, caplog: pytest.LogCaptureFixture) -> None:
    async with console(fleet, HELLO | {"world": "w" * 100_000}, {}) as (reader, _):
        assert await reader.read() == b""
    assert len(caplog.text) < 1000


async def test_a_classroom_that_hangs_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(class_link, "UNREAD_MAX", 1 << 20)
    came, over = asyncio.Event(), asyncio.Event()

    async def hang(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        came.set()
        await reader.readline()
        await over.wait()
        writer.transport.abort()

    server = await asyncio.start_unix_server(hang, tmp_path / "class")
    room = LinkedRoom(tmp_path / "class", Hello("w1", ""), AsyncMock(), Mock())
    await came.wait()
    seat = room.seat(Mock())
    with pytest.raises(Refused, match="out of reach"):
        _draw(seat, 40)
    await room.end()
    over.set()
    server.close()
    await server.wait_closed()


def _draw(seat: LinkedSeat, times: int) -> None:
    for _ in range(times):
        seat.draw("x" * 100_000)
