"""Tests of requests to a running `roboglot up`, over its socket."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from roboglot.cli.control import running
from roboglot.hosting.local_socket import LocalServer
from roboglot.protocols.record_desk import Answer, Request


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b'{"error": "nothing is being recorded"}', "roboglot record: nothing is being recorded"),
        (b'{"error": 5}', "roboglot record: the program in .* is of another version"),
        (b"[" * 20, "roboglot record: the program in .* is of another version"),
    ],
)
async def test_command_ends_with_a_sentence(line: bytes, reason: str, tmp_path: Path) -> None:
    async def answer(request: bytes) -> bytes:
        return line

    server = LocalServer(tmp_path / "s", "record", answer)
    await server.open()
    try:
        with pytest.raises(SystemExit, match=reason):
            await asyncio.to_thread(running.request, "record", tmp_path / "s", Request("stop"), Answer, 10.0)
    finally:
        await server.close()
