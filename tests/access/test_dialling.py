"""Calls of a gateway that cannot be reached: bounded, reported once, and a failure where one call was wanted."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from roboglot.access.tunnel import connector, dialling
from roboglot.access.tunnel.connector import KnownGateways
from roboglot.access.tunnel.dialling import Dialling, Ended, FixedGateway, Gateway


def dial(port: int, folder: Path, said: list[str]) -> Dialling:
    gateway = Gateway("127.0.0.1", port, KnownGateways(folder / "gateways.json"))
    return Dialling(FixedGateway(gateway), "a", "token", "127.0.0.1", lambda *_: None, said.append)


async def test_gateways_that_do_not_answer_are_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connector, "CALL_SECONDS_MAX", 0.05)
    writers = list[asyncio.StreamWriter]()
    server = await asyncio.start_server(lambda _reader, writer: writers.append(writer), "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    with pytest.raises(Ended, match=f"robot a: 127.0.0.1:{port}: no answer"):
        await dial(port, tmp_path, []).keep(once=True)
    server.close()
    for writer in writers:
        writer.close()
        await writer.wait_closed()


async def test_a_failure_that_repeats_is_reported_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dialling, "AGAIN_AFTER", 0.0)
    calls = asyncio.Semaphore(0)

    async def hang_up(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        calls.release()
        writer.close()

    server = await asyncio.start_server(hang_up, "127.0.0.1", 0)
    said: list[str] = []
    keeping = asyncio.ensure_future(dial(server.sockets[0].getsockname()[1], tmp_path, said).keep())
    for _ in range(4):
        await calls.acquire()
    keeping.cancel()
    await asyncio.wait([keeping])
    server.close()
    assert len(said) == 1
    assert said[0].endswith("; trying again")
