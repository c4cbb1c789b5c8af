"""Pupils of a fleet where names are asked for: a class's code lets them in, each into the world that is theirs."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from roboglot.access.store import Grant, open_store
from roboglot.config import AccessConfig
from roboglot.operations import Right
from roboglot.shards.classes import FleetClasses
from roboglot.shards.plan import checked, plan_fleet
from tests.console.conftest import ADDRESS, OTHER_ADDRESS, ServedConsole
from tests.console.test_classes import asked, grid, opened, world
from tests.console.test_studio_socket import SAVE, Page

PASSWORD = "a long enough secret"


def post(url: str, shows: dict[str, str]) -> tuple[int, dict[str, Any], str]:
    """Return the answer to a log-in page, and the cookie."""
    try:
        with urlopen(Request(f"{url}/api/sign_in", data=json.dumps(shows).encode()), timeout=60) as reply:
            return reply.status, json.loads(reply.read()), str(reply.headers["set-cookie"] or "").partition(";")[0]
    except HTTPError as error:
        with error:
            return error.code, json.loads(error.read()), ""


async def signed(served: ServedConsole, **shows: str) -> tuple[int, dict[str, Any], str]:
    return await asyncio.to_thread(post, served.url, shows)


@asynccontextmanager
async def paged(served: ServedConsole, cookie: str) -> AsyncIterator[Page]:
    """Yield the studio's page of the client with this cookie."""
    url = served.url.replace("http", "ws") + "/studio"
    async with connect(url, max_size=None, additional_headers={"Cookie": cookie}) as socket:
        made = Page(socket)
        await made.say(type="open", robot="a")
        await made.kind("opened")
        yield made


async def test_a_code_lets_pupils_into_their_worlds(tmp_path: Path) -> None:
    classes, asking = FleetClasses(tmp_path), AccessConfig(on=True, local=False)
    await classes.open()
    (tmp_path / "w1").mkdir()
    store = open_store(tmp_path / "w1")
    store.add_person("mx", PASSWORD, [Grant("*", frozenset({Right.ADMIN}))])
    store.close()
    async with (
        world(tmp_path, "w1", ADDRESS, access=asking) as first,
        world(tmp_path, "w2", OTHER_ADDRESS, access=asking) as second,
    ):
        _, _, cookie = await signed(first, name="mx", password=PASSWORD)
        async with paged(first, cookie) as teacher:
            code = await opened(teacher)
            assert (await signed(second, name="Anna", code="AAAAAA"))[0] == 401
            status, anna, key = await signed(first, name="Anna", code=code.lower())
            assert (status, anna["robot"], anna["studio"]) == (200, "a", code)
            assert key
            status, ben, none = await signed(first, name="Ben B", code=code)
            assert (status, ben, none) == (200, {"elsewhere": second.url, "code": code, "name": "Ben-B"}, "")
            status, _, key = await signed(second, name=ben["name"], code=code)
            assert status == 200
            async with paged(second, key) as page:
                await asked(page, do="join", code="ZZZZZZ", name="Anna", id=3)  # as who he is, whatever he says
                assert (await page.kind("joined"))["name"] == "Ben-B"
                await grid(teacher, name="Ben-B", world="w2", here=True)
                answer = await page.frame(**SAVE, id="1", body="print(1)\n")
                assert answer["feedback"]["state"] == 0
                await asked(page, do="open", id=4, name="mine")
                assert "opening a class needs the right admin" in (await page.kind("refused"))["why"]
                await asked(teacher, do="close")
                assert (await teacher.kind("ended"))["type"] == "ended"
                with pytest.raises(ConnectionClosed):  # his right ended with the class
                    await page.kind("no more")
            assert (await signed(second, name="Ben-B", code=code))[0] == 401
    await classes.close()


async def test_old_class_admits_no_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The class is closed until its teacher is back."""
    asking = AccessConfig(on=True, local=True)
    async with world(tmp_path, "w", ADDRESS, shared=False, access=asking) as served, paged(served, "") as teacher:
        code = await opened(teacher)
        assert (await signed(served, name="Anna", code=code))[0] == 200
        monkeypatch.setattr("roboglot.console.studio.classroom.OPEN_SECONDS", 0.0)
        await asked(teacher, do="open", code=code)
        await grid(teacher, name="Anna")
        status, answer, _ = await signed(served, name="Ben", code=code)
        assert (status, answer["error"]) == (401, "this class is over, unless its teacher comes back")


async def test_joined_emoji_and_marks_of_direction_sign_in(tmp_path: Path) -> None:
    """A family of three was refused as if it were too long, and the studio asked for a name that was given."""
    asking = AccessConfig(on=True, local=True)
    async with world(tmp_path, "w", ADDRESS, shared=False, access=asking) as served, paged(served, "") as teacher:
        code = await opened(teacher)
        status, taken, _ = await signed(served, name="\U0001f469\u200d\U0001f3eb Ms\u200f", code=code)
        assert (status, taken["robot"]) == (200, "a")
        async with paged(served, "") as page:
            await asked(page, do="join", code=code, name="\u200fSara\u200d")
            assert (await page.kind("joined"))["name"] == "Sara"
            await asked(page, do="join", code=code, name="two\nlines")
            assert "no line breaks" in (await page.kind("refused"))["why"]


async def test_rights_that_are_gained_reach_open_pages(tmp_path: Path) -> None:
    (tmp_path / "w").mkdir()
    store = open_store(tmp_path / "w")
    store.allow("127.0.0.1", [Grant("*", frozenset({Right.SEE}))])
    access = AccessConfig(on=True, local=False)
    async with (
        world(tmp_path, "w", ADDRESS, shared=False, access=access) as served,
        connect(served.url.replace("http", "ws") + "/live", max_size=None) as page,
        asyncio.timeout(60),
    ):

        async def rights() -> list[str]:
            while True:
                text = await page.recv()
                if isinstance(text, str) and (message := json.loads(text))["type"] == "hello":
                    return [right for robot in message["robots"] for right in robot["rights"]]

        assert await rights() == ["see"]
        store.allow("127.0.0.1", [Grant("*", frozenset({Right.DRIVE}))])
        assert served.runtime.guard is not None
        served.runtime.guard.reload()  # it looks by itself once a second
        assert await rights() == ["see", "drive"]
    store.close()


@pytest.mark.slow  # in short: test_a_code_lets_pupils_into_their_worlds
async def test_one_list_lets_people_into_all_worlds(tmp_path: Path) -> None:
    plan = plan_fleet(2, 1, {"access": {"local": False}}, tmp_path)
    asking = checked(plan.shards[1]).access
    assert asking == checked(plan.shards[0]).access
    store = open_store(tmp_path)
    store.add_person("mx", PASSWORD, [Grant("*", frozenset({Right.ADMIN}))])
    async with (
        world(tmp_path, "w1", ADDRESS, shared=False, access=asking) as first,
        world(tmp_path, "w2", OTHER_ADDRESS, shared=False, access=asking) as second,
    ):
        assert [(await signed(one, name="mx", password=PASSWORD))[0] for one in (first, second)] == [200, 200]
        store.revoke("mx")
        for one in (first, second):
            assert one.runtime.guard is not None
            one.runtime.guard.reload()
            assert (await signed(one, name="mx", password=PASSWORD))[0] == 401
    store.close()


async def test_signing_out_ends_open_pages_and_sound(tmp_path: Path) -> None:
    """A page in another tab drove on as the one who had signed out."""
    (tmp_path / "w").mkdir()
    store = open_store(tmp_path / "w")
    store.add_person("mx", PASSWORD, [Grant("*", frozenset({Right.ADMIN}))])
    store.close()
    access = AccessConfig(on=True, local=False)
    async with world(tmp_path, "w", ADDRESS, shared=False, access=access) as served, asyncio.timeout(60):
        (_, _, left), (_, _, kept) = [await signed(served, name="mx", password=PASSWORD) for _ in range(2)]
        live = served.url.replace("http", "ws") + "/live"
        other = connect(live, max_size=None, additional_headers={"Cookie": kept})
        async with connect(live, max_size=None, additional_headers={"Cookie": left}) as page, other as stays:
            listen = Request(f"{served.url}/api/robots/a/sound.wav", headers={"Cookie": left})
            with await asyncio.to_thread(urlopen, listen) as sound:
                leave = Request(f"{served.url}/api/sign_out", data=b"", headers={"Cookie": left})
                (await asyncio.to_thread(urlopen, leave)).close()
                with suppress(ConnectionClosed):
                    while await page.recv():
                        pass
                assert page.close_code == 1008
                await served.clock.advance(1.0)
                await asyncio.to_thread(sound.read)
            await stays.send(json.dumps({"type": "ping", "at": 1.0}))
            while "pong" not in str(await stays.recv()):
                pass
