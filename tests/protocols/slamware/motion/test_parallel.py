"""Many clients at once, each with a connection of its own: every request is answered, and what was said is there."""

from __future__ import annotations

import asyncio
import json
import resource
from collections.abc import Iterator

import httpx
import pytest

from roboglot.protocols.slamware.server import SlamwareDoor

CLIENTS = 2000  # HttpConnection's limit is 2048
POIS = "/api/core/artifact/v1/pois"


@pytest.fixture(autouse=True)
def sockets() -> Iterator[None]:
    """Both ends of each connection are in this process."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < 3 * CLIENTS:
        pytest.skip(f"a process may open {hard} files here")
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, max(soft, 3 * CLIENTS)), hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.slow  # a hundred: tests/protocols/slamware/test_http.py
async def test_two_thousand_requests_at_once_lose_none(bare_door: SlamwareDoor, bare_client: httpx.AsyncClient) -> None:
    everybody = asyncio.Barrier(CLIENTS)

    async def client(number: int) -> bytes:
        body = json.dumps({"id": f"p{number}", "pose": {"x": number, "y": 0}}).encode()
        reader, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
        try:
            await everybody.wait()  # all are connected before the first one asks
            head = (
                f"POST {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nContent-Length: {len(body)}\r\n\r\n"
            )
            writer.write(head.encode() + body)
            return await reader.read()
        finally:
            writer.close()

    answers = await asyncio.gather(*map(client, range(CLIENTS)))
    assert {answer[:15] for answer in answers} == {b"HTTP/1.1 200 OK"}
    kept = (await bare_client.get(POIS)).json()
    assert {place["id"]: place["pose"]["x"] for place in kept} == {f"p{number}": number for number in range(CLIENTS)}
