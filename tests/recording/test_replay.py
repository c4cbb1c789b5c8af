"""Recorded requests are sent again, and what another robot answers otherwise is found."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve

from roboglot.clients.errors import ClientError
from roboglot.model.clock import RealClock
from roboglot.model.tap import SILENT, Direction, Exchange
from roboglot.recording.comparing.comparison import Comparison, answers_only, compare
from roboglot.recording.comparing.ids import IdMap
from roboglot.recording.lines import Line, Target, status_of
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


@pytest.mark.slow
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


class Numbered:
    """A robot over REST that numbers actions and walls, and names places; ``muddle`` spoils its newest action."""

    def __init__(self, first: int, muddle: str = "") -> None:
        self._actions, self._walls, self._muddle = itertools.count(first), itertools.count(first + 2), muddle
        self._known: list[str] = []

    def answer(self, request: str) -> tuple[str, str]:
        method, _, path = request.partition("\n")[0].partition(" ")
        kind, _, name = path.strip("/").partition("/")
        if method == "POST":
            key = {"actions": "action_id", "walls": "id", "places": "id"}[kind]
            numbers = self._actions if kind == "actions" else self._walls
            made = json.dumps(str(uuid.UUID(int=next(numbers))) if kind == "places" else next(numbers))
            self._known.append(f"{kind}/{made}")
            return "200", f'{{"{key}": {made}, "floor_id": 1, "map_id": "ground floor"}}'
        if method == "PUT":
            wanted = json.loads(request.partition("\n\n")[2])["action_id"]
            return ("200", "{}") if f"actions/{wanted}" in self._known else ("404", "{}")
        if name == ":current":
            mine = [int(each.partition("/")[2]) for each in self._known if each.startswith("actions/")]
            now = {"stuck": mine[0], "ahead": mine[-1] + 1, "": mine[-1]}[self._muddle]
            return "200", f'{{"action_id": {now}}}'
        known = f"{kind}/{name}" in self._known or f'{kind}/"{name}"' in self._known
        return ("200", "{}") if known else ("404", "{}")


ALL = (
    "POST /actions\n\n", "POST /actions\n\n", "POST /walls\n\n", "POST /places\n\n", "GET /actions/:current\n\n",
    "GET /actions/1\n\n", "GET /walls/3\n\n", 'PUT /actions\n\n{"action_id": 2, "map_id": 1}',
    f"DELETE /places/{uuid.UUID(int=4)}\n\n", "POST /actions\n\n", "GET /actions/:current\n\n", "GET /actions/99\n\n",
)  # fmt: skip


class ToNumbered(Line):
    """A line to such a robot; ``heard``: the requests that arrived."""

    def __init__(self, robot: Numbered, heard: list[str]) -> None:
        self._robot, self._heard = robot, heard

    async def open(self) -> None:
        """Nothing to open."""

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> list[tuple[bytes, str]]:
        """Send one request."""
        del operation, answers
        self._heard.append(payload.decode())
        status, text = self._robot.answer(payload.decode())
        return [(text.encode(), status)]

    async def close(self) -> None:
        """Nothing to close."""


async def repeated(robot: Numbered, heard: list[str]) -> Comparison:
    """Replay a session with a robot that began to count at 1 to another, and compare."""
    target = Target("slamware://h")
    first, recorded = Numbered(1), list[Exchange]()
    for request in ALL:
        status, text = first.answer(request)
        operation = request.partition("\n")[0]
        asked = Exchange(0.0, "a", "slamware", "x:1", "x", Direction.REQUEST, operation, request.encode())
        recorded += [asked, asked._replace(direction=Direction.REPLY, payload=text.encode(), status=status)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Target, "line", lambda *_: ToNumbered(robot, heard))
        live = await Replay(recorded, target, RealClock(), fast=True).run()
    return compare(recorded, live, ids=IdMap())


async def test_new_name_of_a_thing_is_no_difference() -> None:
    heard: list[str] = []
    comparison = await repeated(Numbered(2), heard)  # 2 and 3 are also names of the recording, for other things
    assert [(row.operation, row.differences) for row in comparison.rows if row.differences] == []
    assert heard[5:9] == [
        "GET /actions/2\n\n", "GET /walls/4\n\n", 'PUT /actions\n\n{"action_id": 3, "map_id": 1}',
        f"DELETE /places/{uuid.UUID(int=5)}\n\n",
    ]  # fmt: skip


async def test_requests_of_several_connections_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though the first connection takes longer than the next requests are away."""
    heard, texts = list[str](), [f"GET /{n}\n\n" for n in range(9)]
    delays = itertools.chain([0.1], itertools.repeat(0.0))

    class Slow(ToNumbered):
        async def open(self) -> None:
            await asyncio.sleep(next(delays))

    asked = Exchange(0.0, "a", "slamware", "", "x", Direction.REQUEST, "GET", b"")
    recorded = [
        asked._replace(stamp=0.001 * n, connection=f"x:{n % 3}", payload=text.encode()) for n, text in enumerate(texts)
    ]
    monkeypatch.setattr(Target, "line", lambda *_: Slow(Numbered(1), heard))
    await Replay(recorded, Target("slamware://h"), RealClock()).run()
    assert heard == texts


@pytest.mark.parametrize("muddle", ["stuck", "ahead"])
async def test_name_of_another_thing_is_a_difference(muddle: str) -> None:
    comparison = await repeated(Numbered(7, muddle), [])
    [current] = [row for row in comparison.rows if row.operation == "GET /actions/:current"]
    assert [difference.what for difference in current.differences][:1] == ["$.action_id"]


def test_words_and_other_fields_are_no_ids() -> None:
    ids = IdMap()
    for path, one, other in (("$.grid", 3, 4), ("$.valid", 1, 2), ("$.map_id", "office", "lobby"), ("$.x", 1, 2)):
        assert ids.agree(path, one, other) is None
    assert ids.agree("$.action_id", 1, "1") is None
    assert ids.agree("$.taskId", "order-2026-0001", "order-2026-0007")
    assert not ids.agree("$.taskId", "order-2026-0001", "order-2026-0008")
    assert not ids.agree("$.taskId", "order-2026-0002", "order-2026-0007")
