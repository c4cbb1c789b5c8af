"""The page of all worlds: lists them, asks consoles once a second at most, and says why a world is not there."""

from __future__ import annotations

import asyncio
import io
import json
from email.message import Message
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar
from unittest.mock import patch
from urllib.error import HTTPError
from urllib.request import Request

import pytest

from roboglot.agents.console import ConsoleClient, Refused
from roboglot.shards import snapshots
from roboglot.shards.messages import Beat, Ready
from roboglot.shards.overview import PAGE, SEEN_MAX, Overview
from roboglot.shards.plan import plan_fleet
from roboglot.shards.snapshots import Snapshots
from roboglot.shards.states import Shard, State
from roboglot.transport import http as connections

PICTURE = b"\x89PNG"


class Console(ConsoleClient):
    """A world's console that counts what it is asked."""

    asked: ClassVar[list[tuple[str, ...]]] = []

    async def fetch(self, *path: str, body: bytes | None = None) -> bytes:  # noqa: ARG002
        self.asked.append(path)
        await asyncio.sleep(0)
        if path[1] == "a2":
            raise Refused("sign in first")
        return PICTURE if path[-1] == "map.png" else b'{"battery": {"charge": 0.5}, "history": ["long"]}'


def fleet_of(worlds: int, folder: Path) -> Any:
    """Return a fleet whose last world has failed."""
    plan = plan_fleet(worlds, 1, {}, folder, first="127.16.3.1")
    shards = {p.name: Shard(number, p, folder) for number, p in enumerate(plan.shards, start=1)}
    *up, failed = shards.values()
    for shard in up:
        shard.state, shard.ready, shard.beat = State.READY, Ready({}, "http://127.16.3.1:50080"), Beat(1.0, 0, 0.0)
    failed.state, failed.reason = State.FAILED, "the disk is full"
    Console.asked = []
    return SimpleNamespace(plan=plan, shards=shards)


@pytest.fixture
def fleet_host(tmp_path) -> Any:
    return fleet_of(3, tmp_path)


async def test_many_pages_cost_a_world_one_request(fleet_host) -> None:
    glances = Snapshots(fleet_host, Console)
    states = await asyncio.gather(*(glances.state("a1") for _ in range(20)))
    assert states == [{"battery": {"charge": 0.5}}] * 20  # and no history: tiles do not show it
    assert await glances.picture("a1") == await glances.picture("a1") == PICTURE
    assert Console.asked == [("robots", "a1"), ("robots", "a1", "map.png")]


async def test_worlds_that_do_not_answer_say_why(fleet_host) -> None:
    glances = Snapshots(fleet_host, Console)
    assert await glances.state("a2") == {"error": "sign in first"}
    assert await glances.state("a3") == {"error": "this world has no console"}
    with pytest.raises(Refused, match="sign in first"):
        await glances.picture("a2")


async def test_a_hung_world_holds_up_no_other(fleet_host, monkeypatch: pytest.MonkeyPatch) -> None:
    class Hung(Console):
        async def fetch(self, *path: str, body: bytes | None = None) -> bytes:
            if path[1] == "a1":
                await answers.wait()
            return await super().fetch(*path, body=body)

    answers = asyncio.Event()
    monkeypatch.setattr(snapshots, "ANSWER_MAX", 0.01)
    page = Overview(fleet_host, "127.16.3.1")
    page._snapshots = Snapshots(fleet_host, Hung)
    found = await page.look(["a1", "a3"])
    assert found["robots"] == {
        "a1": {"error": "its console does not answer"},
        "a3": {"error": "this world has no console"},
    }
    answers.set()
    assert await page._snapshots.state("a1") == {"battery": {"charge": 0.5}}


async def test_silent_worlds_are_not_asked(fleet_host) -> None:
    """Each request would hold one of the program's few threads until it is given up."""
    glances = Snapshots(fleet_host, Console)
    fleet_host.shards["w1"].silent = 4.0
    assert await glances.state("a1") == {"error": "not answering for 4 s"}
    with pytest.raises(Refused, match="not answering for 4 s"):
        await glances.picture("a1")
    assert Console.asked == []


async def test_hung_consoles_are_given_up_early(fleet_host) -> None:
    limits: list[float] = []

    def hang(_: Request, timeout: float) -> None:
        limits.append(timeout)
        raise TimeoutError("timed out")

    with patch("roboglot.agents.console.urlopen", hang):
        assert "timed out" in str(await Snapshots(fleet_host).state("a1"))
    assert limits == [snapshots.ANSWER_MAX]


async def test_other_programs_at_an_address_are_named(fleet_host) -> None:
    """Another one may listen there by now, or the world's has written nonsense as it died."""

    def serve(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"\x1b[2Jnonsense\r\n\r\n")
        writer.close()

    other = await asyncio.start_server(serve, "127.0.0.1", 0)
    url = "http://127.0.0.1:{1}".format(*other.sockets[0].getsockname())
    fleet_host.shards["w1"].ready = Ready({}, url)
    found = await Snapshots(fleet_host).state("a1")
    assert found == {"error": f"no roboglot answers at {url}: it is no HTTP (BadStatusLine)"}
    other.close()


async def test_worlds_that_ask_for_a_log_in(fleet_host) -> None:
    """Each console has its own; a browser that signs in there is not known to the fleet's page."""

    def refuse(request: Request, timeout: float) -> None:
        raise HTTPError(request.full_url, 401, "Unauthorized", Message(), io.BytesIO(b'{"error": "say who you are"}'))

    with patch("roboglot.agents.console.urlopen", refuse):
        assert await Snapshots(fleet_host).state("a1") == {"error": "its console asks for a log-in: sign in there"}


async def test_unknown_robots_have_no_state(fleet_host) -> None:
    glances = Snapshots(fleet_host, Console)
    with pytest.raises(LookupError):
        await glances.state("zoe")


async def request(page: Overview, line: str, host: str = "127.16.3.1") -> tuple[int, bytes]:
    address, port = page.address.removeprefix("http://").removesuffix(PAGE).split(":")
    reader, writer = await asyncio.open_connection(address, int(port))
    writer.write(f"{line} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
    head, _, body = (await reader.read()).partition(b"\r\n\r\n")
    writer.close()
    return int(head.split()[1]), body


async def test_page_lists_all_worlds_and_changes_nothing(fleet_host) -> None:
    page = Overview(fleet_host, "127.16.3.1", 0)
    page._snapshots = Snapshots(fleet_host, Console)
    page.open()
    await page.ready()
    try:
        status, body = await request(page, "GET /api/fleet?seen=a1,a2,a3")
        found = json.loads(body)
        assert status == 200
        assert [(world["name"], world["state"], world["reason"]) for world in found["worlds"]] == [
            ("w1", "ready", ""),
            ("w2", "ready", ""),
            ("w3", "failed", "the disk is full"),
        ]
        assert found["worlds"][1]["robots"] == [{"name": "a2", "body": "universal", "address": "127.16.3.2"}]
        assert found["robots"]["a2"] == {"error": "sign in first"}
        assert await request(page, "GET /api/fleet/a1/map.png") == (200, PICTURE)
        statuses = {
            line: (await request(page, line))[0]
            for line in (
                "GET /",
                f"GET {PAGE}",
                "GET /fleet/fleet.js",
                "GET /nothing",
                "POST /api/fleet",
                "GET /api/fleet/zoe/map.png",
                "GET /api/fleet/a2/map.png",
                f"GET /api/fleet?seen={'a1,' * (SEEN_MAX + 1)}",
            )
        }
        assert list(statuses.values()) == [303, 200, 200, 404, 405, 404, 502, 400]
        assert (await request(page, "GET /api/fleet", host="rebound.example"))[0] == 403
    finally:
        await page.close()


async def test_slow_head_is_not_waited_for(fleet_host, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "REQUEST_SECONDS_MAX", 0.1)
    page = Overview(fleet_host, "127.16.3.1", 0)
    page.open()
    await page.ready()
    try:
        address, port = page.address.removeprefix("http://").removesuffix(PAGE).split(":")
        reader, writer = await asyncio.open_connection(address, int(port))
        writer.write(b"GET / HTTP/1.1\r\nX: ")
        async with asyncio.timeout(60.0):
            assert await reader.read() == b""
        writer.close()
    finally:
        await page.close()


async def test_page_is_for_this_machine_alone(fleet_host) -> None:
    page = Overview(fleet_host, "192.0.2.1")
    page.open()
    assert page.address == ""
    await page.close()
