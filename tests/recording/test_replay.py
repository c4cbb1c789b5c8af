"""Recorded requests are sent again, and what another robot answers otherwise is found."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve

from roboglot.clients.errors import ClientError
from roboglot.model.clock import RealClock
from roboglot.model.tap import SILENT, Direction, Exchange
from roboglot.recording.comparing.comparison import answers_only, compare
from roboglot.recording.lines import Target, status_of
from roboglot.recording.reader import BadRecording, Recording, read_recording
from roboglot.recording.replaying import Replay
from tests.recording.test_compare import session
from tests.recording.test_playback import ADDRESS, SPEED, by_frames, by_rest, run

URLS = {"slamware": f"slamware://{ADDRESS}", "visual": f"visual://{ADDRESS}", "robomaster": f"robomaster://{ADDRESS}"}


async def everything(address: str) -> None:
    await by_rest(address)
    await by_frames(address)
    reader, writer = await asyncio.open_connection(address, 40923)
    for text in (
        b"command;",
        b"version;",
        b"chassis speed ?;",
        b"led control comp all r 9 g 9 b 9 effect solid;",
        b"x y;",
    ):
        writer.write(text)
        await reader.readuntil(b";")
    writer.close()
    with contextlib.suppress(OSError):
        await writer.wait_closed()


async def test_three_protocol_recording_agrees_only_with_its_double(tmp_path: Path) -> None:
    file = tmp_path / "r.mcap"
    await run(tmp_path, "universal", str(file), everything)
    recording = read_recording(file)

    async def replay(_: str) -> dict[str, list[Exchange]]:
        clock = RealClock(SPEED)
        return {
            door: await Replay(recording.of(door=door), Target(url), clock, fast=True).run()
            for door, url in URLS.items()
        }

    def differing(live: dict[str, list[Exchange]]) -> set[str]:
        comparisons = {
            door: compare(answers_only(recording.of(door=door)), answers_only(live[door]), order=False) for door in URLS
        }
        return {
            f"{row.operation}: {difference.what}"
            for comparison in comparisons.values()
            for row in comparison.rows
            for difference in row.differences
            if difference.what != "seconds"
        }

    double: Any = await run(tmp_path, f"recording:{file}", "", replay)
    assert differing(double) == set()
    dog: Any = await run(tmp_path, "cyberdog2", "", replay)
    assert any(line.startswith(("GET ", "POST ", "chassis")) for line in differing(dog))


async def test_answer_to_what_is_no_frame_is_found() -> None:
    """It has an empty id, as the request has none."""
    said = b'{"feedback": {"type": "parse", "id": "", "state": 1}}'

    async def answer(socket: ServerConnection) -> None:
        async for _ in socket:
            await socket.send('{"block": {"id": "b"}}')
            await socket.send(said.decode())

    async with serve(answer, ADDRESS, 0) as server:
        port = server.sockets[0].getsockname()[1]
        line = Target(f"visual://{ADDRESS}:{port}").line(RealClock(), lambda *_: None)
        await line.open()
        for payload in (b"garbage", b'{"type": "module"}', b"[]"):
            assert await line.request("", payload, [said]) == [(said, "state 1")]
        await line.close()


def test_silence_agrees_with_silence() -> None:
    """Doors note it, proxies and clients see nothing."""
    request = Exchange(0.0, "a", "cyberdog", "x:1", "x", Direction.REQUEST, "9999", b"{}")
    silence = request._replace(direction=Direction.REPLY, payload=b"", status=SILENT)
    answer = silence._replace(payload=b"{}", status="ok")
    assert compare([request, silence], [request]).fidelity == 1.0
    assert compare([request, silence], [request, answer]).differs


async def test_robot_that_is_not_there_is_an_error() -> None:
    text = [exchange for exchange in session() if exchange.door == "robomaster"]
    with pytest.raises(ExceptionGroup) as raised:
        await Replay(text, Target("robomaster://127.0.0.87:9"), RealClock()).run()
    assert raised.group_contains(ClientError, match="cannot be reached")
    with pytest.raises(BadRecording, match="no message"):
        Recording(Path("x.mcap"), exchanges=text).session(door="cyberdog")


@pytest.mark.parametrize(
    ("url", "door", "port"),
    [
        ("slamware://h", "slamware", 1448),
        ("robomaster://h:7", "robomaster", 7),
        ("cyberdog://h?certs=x", "cyberdog", 50052),
    ],
)
def test_urls_name_a_protocol_and_a_host(url: str, door: str, port: int) -> None:
    target = Target(url)
    assert (target.door, target.port) == (door, port)


@pytest.mark.parametrize("url", ["", "slamware://", "http://h", "robomaster://h:seven", "cyberdog://h?certs"])
def test_other_urls_are_refused(url: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        Target(url)


def test_status_of_answer_is_in_the_taps_words() -> None:
    assert status_of("robomaster", b"ok;") == status_of("robomaster", b"1 2 3;") == "ok"
    assert status_of("robomaster", b"fail;") == "fail"
    assert status_of("cyberdog", b'{"error_code": 104}') == "error_code 104"
    assert status_of("visual", b'{"feedback": {"state": 29}}') == "state 29"
    assert status_of("visual", b'{"response": {}}') == "ok"
