"""Browsers stay signed in when the program is started again; what ended a session before, or meanwhile, counts."""

from __future__ import annotations

import asyncio
import json
import time
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from roboglot.access.session_file import KeptSession, SessionFile, seal
from roboglot.access.store import Grant, open_store
from roboglot.config import AccessConfig
from roboglot.console.people.sessions import LIFETIME, Sessions
from roboglot.hosting.steady_time import SteadyTime
from roboglot.model.admission import Proof, ProofKind
from roboglot.model.components.system.lease import Lease
from roboglot.operations import Right
from tests.console.conftest import ADDRESS, ServedConsole
from tests.console.test_class_sign_in import PASSWORD, paged, signed
from tests.console.test_classes import asked, grid, opened, world
from tests.console.test_studio_socket import SAVE

PROOF = Proof(ProofKind.HTTP, "Basic a secret")
ASKING = AccessConfig(on=True, local=False)


async def test_file_lets_no_one_in_but_the_cookie(tmp_path: Path) -> None:
    now = 1000.0
    first = Sessions(SessionFile(tmp_path / "s.db"), lambda: now)
    cookie, left = await first.open(PROOF, "anna"), await first.open(PROOF, "ben")
    await first.end(left)
    first.close()
    kept = b"".join(file.read_bytes() for file in sorted(tmp_path.glob("*")))  # noqa: ASYNC240 - small
    assert b"anna" in kept
    assert not [secret for secret in (cookie, "a secret") if secret.encode() in kept]
    assert (tmp_path / "s.db").stat().st_mode & 0o077 == 0

    second = Sessions(SessionFile(tmp_path / "s.db"), lambda: now)
    assert [session.name for session in second.all()] == ["anna"]
    assert second.find("another") is second.find(left) is None
    found = second.find(cookie)
    assert found is not None
    assert found.proof == PROOF
    assert second.find(cookie) == found
    second.close()
    now += LIFETIME
    third = Sessions(SessionFile(tmp_path / "s.db"), lambda: now)
    assert third.find(cookie) is None
    third.close()


async def test_a_clock_set_back_prolongs_no_session(tmp_path: Path) -> None:
    """A board without a clock of its own begins in 1970 until it has asked for the time."""
    now = 1_900_000_000.0
    first = Sessions(SessionFile(tmp_path / "s.db"), lambda: now)
    cookie = await first.open(PROOF, "anna")
    first.close()
    now = 0.0
    second = Sessions(SessionFile(tmp_path / "s.db"), lambda: now)
    assert second.find(cookie) is not None
    now = LIFETIME
    assert second.find(cookie) is None
    assert second.all() == []
    second.close()


async def test_putting_out_while_signing_in_lasts(tmp_path: Path) -> None:
    now = 1000.0
    first = Sessions(SessionFile(tmp_path / "s.db"), lambda: now)
    await first.open(PROOF, "ben")
    now += LIFETIME  # his row is to be deleted, for which the next one waits
    await asyncio.gather(first.open(PROOF, "anna"), first.end_all_of("anna"))
    first.close()
    second = Sessions(SessionFile(tmp_path / "s.db"), lambda: now)
    assert second.all() == []
    second.close()


async def test_a_row_that_was_changed_is_no_session(tmp_path: Path) -> None:
    file = SessionFile(tmp_path / "s.db")
    before = Sessions(file)
    cookie = await before.open(PROOF, "anna")
    [kept] = file.load(0.0)
    await file.keep(KeptSession(kept.key, "mx", seal(PROOF, "another cookie"), kept.until, "", ""))
    assert Sessions(file).find(cookie) is None
    before.close()


def me(url: str, cookie: str) -> str:
    """Return the name under which a browser comes in; empty if it does not."""
    try:
        with urlopen(Request(f"{url}/api/me", headers={"Cookie": cookie}), timeout=60) as reply:
            found: dict[str, Any] = json.loads(reply.read())
            return str(found["name"])
    except HTTPError as error:
        with error:
            return "" if error.code == 401 else str(error)


async def names(served: ServedConsole, *cookies: str) -> list[str]:
    return [await asyncio.to_thread(me, served.url, cookie) for cookie in cookies]


@pytest.mark.slow  # in short: test_consoles_class_takes_pupils_after_a_restart
async def test_a_class_goes_on_after_a_restart(tmp_path: Path) -> None:
    add_admins(tmp_path / "w", "mx", "gone", "changed")
    async with world(tmp_path, "w", ADDRESS, shared=False, access=ASKING) as served:
        _, _, teacher = await signed(served, name="mx", password=PASSWORD)
        _, _, gone = await signed(served, name="gone", password=PASSWORD)
        _, _, changed = await signed(served, name="changed", password=PASSWORD)
        async with paged(served, teacher) as page:
            code = await opened(page)
            _, _, anna = await signed(served, name="Anna", code=code)
            _, _, ben = await signed(served, name="Ben", code=code)
        assert await names(served, teacher, gone, anna) == ["mx", "gone", f"Anna@{code}"]
        request = Request(f"{served.url}/api/sign_out", data=b"{}", headers={"Cookie": gone})
        await asyncio.to_thread(lambda: urlopen(request, timeout=60).close())
    store = open_store(tmp_path / "w")
    store.rotate("changed", "another long secret")
    store.close()
    async with world(tmp_path, "w", ADDRESS, shared=False, access=ASKING) as served:
        port = served.url.rpartition(":")[2]  # another one, and cookies have it in their names
        again = [f"roboglot-{port}={cookie.partition('=')[2]}" for cookie in (teacher, anna, ben, gone, changed)]
        assert await names(served, *again[3:]) == ["", ""]
        again = again[:3]
        assert await names(served, *again) == ["mx", f"Anna@{code}", f"Ben@{code}"]
        assert (await signed(served, name="Cem", code=code))[0] == 200  # though its teacher is not back yet
        async with paged(served, again[0]) as page, paged(served, again[1]) as pupil:
            await asked(pupil, do="join", code="ZZZZZZ", name="Ben", id=3)  # a pupil still, under the name of before
            assert (await pupil.kind("joined"))["name"] == "Anna"
            assert (await pupil.frame(**SAVE, id="1", body="print(1)\n"))["feedback"]["state"] == 0
            await asked(page, do="open", code=code)
            await grid(page, name="Anna", here=True)
            await asked(page, do="close")
            assert (await page.kind("ended"))["type"] == "ended"
        assert (await signed(served, name="Anna", code=code))[0] == 401
        async with asyncio.timeout(60):  # they are put out one by one
            while await names(served, *again) != ["mx", "", ""]:  # also who did not come back with a page
                pass


def lesson(url: str, cookie: str, **wish: object) -> dict[str, Any]:
    """Return the class of the console's own page after a wish of its teacher."""
    data = json.dumps(wish).encode() if wish else None
    with urlopen(Request(f"{url}/api/class", data=data, headers={"Cookie": cookie}), timeout=60) as reply:
        found: dict[str, Any] = json.loads(reply.read())
        return found


def add_admins(folder: Path, *names: str) -> None:
    folder.mkdir()
    store = open_store(folder)
    for name in names:
        store.add_person(name, PASSWORD, [Grant("*", frozenset({Right.ADMIN}))])
    store.close()


async def opened_class(served: ServedConsole) -> tuple[str, str]:
    """Open a class on the console's own page; return its teacher's cookie and its code."""
    _, _, teacher = await signed(served, name="mx", password=PASSWORD)
    return teacher, str((await asyncio.to_thread(lesson, served.url, teacher, do="open", name="7b"))["code"])


async def test_consoles_class_takes_pupils_after_a_restart(tmp_path: Path) -> None:
    add_admins(tmp_path / "w", "mx")
    async with world(tmp_path, "w", ADDRESS, shared=False, access=ASKING) as served:
        teacher, code = await opened_class(served)
        _, anna, _ = await signed(served, name="Anna", code=code)
    async with world(tmp_path, "w", ADDRESS, shared=False, access=ASKING) as served:
        teacher = f"roboglot-{served.url.rpartition(':')[2]}={teacher.partition('=')[2]}"
        assert (await signed(served, name="Anna", code=code))[:2] == (200, anna)
        assert (await signed(served, name="Cem", code=code))[0] == 200
        left = await asyncio.to_thread(lesson, served.url, teacher)
        assert (left["code"], left["name"]) == (code, "7b")
        assert [pupil["name"] for pupil in left["pupils"]] == ["Anna", "Cem"]
        assert await asyncio.to_thread(lesson, served.url, teacher, do="close") == {}
        assert (await signed(served, name="Anna", code=code))[0] == 401
    async with world(tmp_path, "w", ADDRESS, shared=False, access=ASKING) as served:
        assert (await signed(served, name="Cem", code=code))[0] == 401


async def test_robots_locked_in_a_class_that_is_over(tmp_path: Path) -> None:
    """They stay locked over a restart, and their teacher can still unlock them."""
    add_admins(tmp_path / "w", "mx")
    async with world(tmp_path, "w", ADDRESS, shared=False, access=ASKING) as served:
        teacher, code = await opened_class(served)
        await signed(served, name="Anna", code=code)
        await asyncio.to_thread(lesson, served.url, teacher, do="lock")
        assert served.robot[Lease].taken_by
    [file] = tmp_path.rglob("open_class.json")  # noqa: ASYNC240 - small
    file.write_text(json.dumps(json.loads(file.read_text()) | {"until": 1.0}))
    async with world(tmp_path, "w", ADDRESS, shared=False, access=ASKING) as served:
        teacher = f"roboglot-{served.url.rpartition(':')[2]}={teacher.partition('=')[2]}"
        assert served.robot[Lease].taken_by
        assert (await signed(served, name="Cem", code=code))[0] == 401
        assert await asyncio.to_thread(lesson, served.url, teacher, do="close") == {}
        assert not served.robot[Lease].taken_by


def test_setting_the_clock_changes_no_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    now, before = SteadyTime(), time.time()
    monkeypatch.setattr(time, "time", lambda: before + 86400.0)
    assert before - 1.0 < now() < before + 3600.0
