"""Messages of the live socket to pages, and their rates."""

from __future__ import annotations

import asyncio
import json
from types import SimpleNamespace
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.asyncio.client import ClientConnection, connect

from roboglot.console.live import Page
from roboglot.console.server import those_due
from roboglot.console.settings import BEAT_PAGES, OTHERS_BEATS, REQUESTS_MAX
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.system.lease import Lease
from tests.console.conftest import ServedConsole


async def test_page_without_map_gets_poses_each_second(served: ServedConsole) -> None:
    """A studio with its Python beside the blocks draws no robot: 25 of them would take a core for nothing."""
    counts = {"drawing": 0, "reading": 0}
    frames = {"drawing": 0, "reading": 0}

    async def count(name: str, page: ClientConnection) -> None:
        async for text in page:
            if isinstance(text, bytes):
                frames[name] += 1
            elif json.loads(text)["type"] == "moment":
                counts[name] += 1
            if counts["drawing"] >= 2 * OTHERS_BEATS:
                return

    live = served.url.replace("http", "ws") + "/live"
    async with connect(live) as drawing, connect(live) as reading, asyncio.timeout(60):
        await drawing.send(json.dumps({"type": "watch", "robot": "a"}))
        await reading.send(json.dumps({"type": "watch", "robot": "a", "moving": False}))
        await asyncio.gather(count("drawing", drawing), count("reading", reading))
        assert 1 <= counts["reading"] <= counts["drawing"] / 3
        assert frames["drawing"] > 0
        assert frames["reading"] == 0
        await reading.send(json.dumps({"type": "watch", "robot": "a", "moving": True}))
        while not isinstance(await reading.recv(), bytes):  # by now the map is shown
            pass


async def test_two_pages_contend_for_control(served: ServedConsole) -> None:
    """The one who took control moves the robot, the others are refused by name; a page may take it from the other."""
    live = served.url.replace("http", "ws") + "/live"

    async def done(page: ClientConnection, verb: str, **values: object) -> str:
        """Return why a page's wish is refused; empty: it is done."""
        await page.send(json.dumps({"type": "do", "id": 1, "robot": "a", "verb": verb, "values": values}))
        while True:
            text = await page.recv()
            if isinstance(text, str) and (answer := json.loads(text))["type"] == "done":
                return str(answer.get("error", ""))

    async with connect(live) as anna, connect(live) as ben, asyncio.timeout(60):
        for page, name in ((anna, "anna"), (ben, "ben")):
            await page.send(json.dumps({"type": "hello", "name": name}))
        assert await done(anna, "take_control") == ""
        assert served.robot[Lease].taken_by == "console anna"
        assert "taken by console anna" in await done(ben, "go_to", points=[[1, 0]])
        assert served.robot.actions.running() == []
        assert await done(ben, "take_control") == ""
        assert "taken by console ben" in await done(anna, "go_to", points=[[1, 0]])
        assert await done(ben, "release_control") == ""
        assert await done(anna, "go_to", points=[[1, 0]]) == ""
        assert len(served.robot.actions.running()) == 1


async def test_crashed_commands_are_answered(
    served: ServedConsole, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A page waited for the answer for ever, and no log line named the command."""

    def crash(_: object) -> None:
        raise RuntimeError("no such bytes")

    monkeypatch.setattr(type(served.robot[Mapping]), "clear", crash)
    async with connect(served.url.replace("http", "ws") + "/live") as page, asyncio.timeout(60):
        await page.send(json.dumps({"type": "do", "id": 7, "robot": "a", "verb": "clear_map"}))
        while isinstance(text := await page.recv(), bytes) or (answer := json.loads(text))["type"] != "done":
            pass
    assert answer == {"type": "done", "id": 7, "error": "internal error: no such bytes"}
    assert "clear_map crashed" in caplog.text


async def test_waiting_stops_leave_room_for_the_clock(served: ServedConsole) -> None:
    """Stops that are pressed again and again while time stands wait for it; the page can still change the world."""
    stops = [{"type": "do", "id": id, "robot": "a", "verb": "stop", "values": {}} for id in range(REQUESTS_MAX + 1)]
    change = {"type": "do", "id": 1000, "robot": "", "verb": "add_box", "values": {"x": 3, "y": 2, "width": 0.5}}
    errors = dict[int, str]()
    await served.ask("/api/robots/a/go_to", {"points": [[2, 0]]})
    await served.clock.advance(2.0)  # it has to brake
    async with connect(served.url.replace("http", "ws") + "/live") as page, asyncio.timeout(60):
        for message in (*stops, change):
            await page.send(json.dumps(message))
        while 1000 not in errors:
            text = await page.recv()
            if isinstance(text, str) and (answer := json.loads(text))["type"] == "done":
                errors[answer["id"]] = answer.get("error", "")
    assert errors == {REQUESTS_MAX: "too many commands are under way", 1000: ""}


@given(drawing=st.integers(0, 32), reading=st.integers(0, 32), number=st.integers(0, 10_000))
def test_many_pages_take_turns(drawing: int, reading: int, number: int) -> None:
    pages = [cast("Page", SimpleNamespace(moving=place < drawing)) for place in range(drawing + reading)]
    turns = -(-drawing // BEAT_PAGES)
    looked = [those_due(pages, beat) for beat in range(number, number + max(turns, 1))]
    assert all(sum(page.moving for page in beat) <= BEAT_PAGES for beat in looked)
    assert all(
        sum(page is one for beat in looked for one in beat) == (1 if page.moving else len(looked)) for page in pages
    )
