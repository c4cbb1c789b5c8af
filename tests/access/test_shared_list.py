"""People, tokens and the audit: alike in files and on a PostgreSQL server, where all programs of a fleet share them."""

from __future__ import annotations

import asyncio
import contextlib
import re
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TypeVar

import httpx
import psycopg
import pytest

from roboglot.access import audit
from roboglot.access.audit import Audit
from roboglot.access.guard import Guard
from roboglot.access.store import FILE, AccessStore, Grant, IdentityKind, open_store
from roboglot.access.trail import FILE as AUDIT
from roboglot.access.trail import BrokenChain, Entry, Trail, open_trail
from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, load_config
from roboglot.model.admission import Proof, ProofKind, Unknown
from roboglot.operations import Right
from roboglot.runtime import Runtime
from roboglot.storage.opening import open_registry
from roboglot.storage.transactions import Connection, DatabaseError, Transactions
from roboglot.testing.addresses import free_addresses
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql

T = TypeVar("T")
ADDRESS = free_addresses(1)
POSE = f"http://{ADDRESS}:1448/api/core/slam/v1/localization/pose"
SEE, DRIVE = frozenset({Right.SEE}), frozenset({Right.DRIVE})
ODD = "naïve 狗\0 \ue000 \ud800'; DROP TABLE audit; --"


@pytest.fixture(params=["file", pytest.param("server", marks=needs_postgresql)])
def url(request: pytest.FixtureRequest) -> str:
    """Return the database of list and audit; empty: in the data folder."""
    return str(request.getfixturevalue("db_server").url) if request.param == "server" else ""


def note(number: int, robot: str = "a") -> Entry:
    return Entry(0.1 + number, "anna", "10.0.0.7:1", robot, "slamware", f"op {number}", "done")


def test_everyone_who_opens_the_list_sees_each_change(tmp_path: Path, url: str) -> None:
    with contextlib.closing(open_store(tmp_path, url)) as one, contextlib.closing(open_store(tmp_path, url)) as two:
        versions = [two.version]

        def changed() -> AccessStore:
            versions.append(two.version)
            assert versions[-1] > versions[-2]
            return one

        token = one.add_machine("cell", [Grant("a", DRIVE, 1234567890.123456), Grant("*", SEE)])
        changed().add_person("anna", "correct horse", [Grant("b", DRIVE)])
        changed().allow("10.0.0.7", [Grant("a", SEE)])
        changed().add_guest("pupil", [Grant("a", DRIVE, 10.0)], now=5.0)
        changed().add_guest("other", [Grant("a", DRIVE, 20.0)], now=15.0)  # the first one's time is up
        assert changed().rotate("cell") != token
        changed().revoke("anna")
        changed()
        found = {identity.name: identity for identity in two.identities()}
        assert {name: entry.kind for name, entry in found.items()} == {
            "cell": IdentityKind.MACHINE,
            "10.0.0.7": IdentityKind.ADDRESS,
            "other": IdentityKind.GUEST,
        }
        assert found["cell"].grants == (Grant("*", SEE), Grant("a", DRIVE, 1234567890.123456))
        assert two.snapshot().version == versions[-1]
        for wrong in (lambda: one.revoke("anna"), lambda: one.rotate("nobody")):
            with pytest.raises(LookupError):
                wrong()
        with pytest.raises(ValueError, match="there is a machine"):
            one.add_guest("cell", [], now=30.0)
        assert {identity.name for identity in two.identities()} == set(found), "what was refused changed nothing"


def test_programs_that_write_at_once_keep_one_chain(tmp_path: Path, url: str) -> None:
    def write(robot: str) -> None:
        with open_trail(tmp_path, url) as trail:
            for number in range(0, 30, 3):
                trail.add([note(number + n, robot) for n in range(3)])

    threads = [threading.Thread(target=write, args=(robot,)) for robot in "abcd"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with open_trail(tmp_path, url) as trail:
        assert trail.verify().number == 120
        for robot in "abcd":
            assert [entry for _, entry in trail.rows(robot=robot)] == [note(n, robot) for n in range(30)]
        assert [number for number, _ in trail.rows(after=118)] == [119, 120]


def test_audit_accepts_any_text_from_clients(tmp_path: Path, url: str) -> None:
    with open_trail(tmp_path, url) as trail:
        trail.add([Entry(1.5, ODD, ODD, ODD, ODD, ODD, ODD, 100 * ODD, 7), note(2)])
        [(_, odd), (_, plain)] = trail.rows()
        assert odd.who == ODD.replace("\ud800", "?")
        assert len(odd.reason) == 300
        assert (odd.repeats, plain) == (7, note(2))
        assert trail.verify().number == 2


class Breaking:
    """A database whose connection breaks after some work was kept, before anyone heard of it."""

    def __init__(self, database: Transactions) -> None:
        self._database, self.breaks = database, 0

    def run_now(self, work: Callable[[Connection], T]) -> T:
        result = self._database.run_now(work)
        if self.breaks:
            self.breaks -= 1
            raise DatabaseError("the connection broke")
        return result


async def test_rows_are_kept_once_where_connection_breaks(
    tmp_path: Path, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(audit, "AGAIN_SECONDS", 0.01)
    with open_trail(tmp_path, url) as trail:
        breaking = Breaking(trail._database)
        broken = Audit(Trail(breaking))  # type: ignore[arg-type]
        for number in range(3):
            breaking.breaks = 2
            broken.note(note(number))
            await until(lambda: not breaking.breaks)
            trail.add([note(100 + number)])  # another program's
        broken.close()
        assert sorted(entry.operation for _, entry in trail.rows()) == sorted(
            f"op {n}" for n in (0, 1, 2, 100, 101, 102)
        )
        assert trail.verify().number == 6


def test_a_changed_or_missing_row_is_found(tmp_path: Path) -> None:
    with open_trail(tmp_path) as trail:
        trail.add([note(n) for n in range(9)])
        with contextlib.closing(sqlite3.connect(tmp_path / AUDIT, isolation_level=None)) as connection:
            connection.executescript("DROP TRIGGER audit_is_kept; DELETE FROM audit WHERE number = 4")
        with pytest.raises(BrokenChain, match="row 4"):
            trail.verify()


@needs_postgresql
def test_server_refuses_changed_audit_and_change_is_found(db_server: PostgreSQLServer, tmp_path: Path) -> None:
    with open_trail(tmp_path, db_server.url) as trail:
        trail.add([note(n) for n in range(9)])
        with psycopg.connect(db_server.url, autocommit=True) as connection:
            for change in ("DELETE FROM audit", "UPDATE audit SET who='bert'", "TRUNCATE audit"):
                with pytest.raises(psycopg.Error, match="the audit stays"):
                    connection.execute(change)
            connection.execute("DROP TRIGGER audit_stays ON audit")
            connection.execute("UPDATE audit SET who='bert' WHERE number=5")
        with pytest.raises(BrokenChain, match="row 5"):
            trail.verify()
    assert not (tmp_path / AUDIT).exists()


@needs_postgresql
async def test_programs_of_fleet_share_list_and_audit(db_server: PostgreSQLServer, tmp_path: Path) -> None:
    base = load_config(None, {"data": str(tmp_path / "data"), "world": "empty", "lockstep": True})
    runtime = Runtime(
        replace(
            base,
            robots=(RobotConfig("a", "universal", ADDRESS),),
            access=AccessConfig(on=True, local=False),
            console=ConsoleConfig(enabled=False),
            database=db_server.url,
        )
    )
    await runtime.start()
    try:
        added = await asyncio.to_thread(access, "add", "cell", "--rights", "see", "--database", db_server.url)
        bearer = {"authorization": f"Bearer {added.stdout.strip()}"}
        async with httpx.AsyncClient(headers=bearer, verify=False) as client:

            async def answers(status: int) -> None:
                async with asyncio.timeout(60.0):
                    while (await client.get(POSE)).status_code != status:  # noqa: ASYNC110 - a thread follows
                        await asyncio.sleep(0.02)

            await answers(200)
            assert (await client.delete(f"http://{ADDRESS}:1448/api/core/slam/v1/maps")).status_code == 403
            revoked = await asyncio.to_thread(access, "revoke", "cell", "--database", db_server.url)
            assert revoked.returncode == 0
            await answers(401)
    finally:
        await runtime.close()
    with open_trail(tmp_path, db_server.url) as trail:
        outcomes = {(entry.who, entry.robot, entry.outcome) for _, entry in trail.rows()}
    assert {("cell", "a", "refused"), ("cell", "a", "lost"), ("", "a", "turned away")} <= outcomes
    assert not list((tmp_path / "data").glob("a[cu]*.db*")), "nothing of it is kept beside the server"


def access(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "roboglot", "access", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)


@needs_postgresql
def test_folders_list_is_copied_and_replaces_no_one(db_server: PostgreSQLServer, tmp_path: Path) -> None:
    with (
        contextlib.closing(open_store(tmp_path)) as local,
        contextlib.closing(open_store(tmp_path, db_server.url)) as there,
    ):
        local.add_machine("cell", [Grant("a", DRIVE, 5.5)])
        local.add_person("anna", "correct horse", [Grant("*", SEE)])
        there.add_person("anna", "better horse", [])
        kept = there.identities()
        assert access("copy", "--data", str(tmp_path), "--database", db_server.url).stdout == "1 copied, 1 were there\n"
        assert there.identities() == [*kept, local.identities()[1]]


@pytest.mark.slow  # in short: test_rows_are_kept_once_where_connection_breaks
@needs_postgresql
async def test_server_away_rights_stay_and_rows_are_kept(
    db_server: PostgreSQLServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(audit, "AGAIN_SECONDS", 0.05)
    moment = 100.0
    database = open_registry(db_server.url)
    guard = Guard(tmp_path, AccessConfig(on=True), {}, shared=database, now=lambda: moment)
    with contextlib.closing(open_store(tmp_path, db_server.url)) as other:
        token = other.add_machine("cell", [Grant("a", DRIVE, 200.0)])
        bearer = Proof(ProofKind.HTTP, f"Bearer {token}")
        guard.start()
        await until(lambda: guard.may("cell", "a", Right.DRIVE))
        db_server.stop()
        guard.audit.note(note(1))
        await until(lambda: {"cannot write the audit yet", "cannot read the list"} <= said(caplog))
        assert await guard.admit("10.0.0.7:1", bearer) == "cell"
        assert guard.may("cell", "a", Right.DRIVE)
        with pytest.raises(DatabaseError):
            await guard.invite("pupil", Grant("a", SEE, 300.0))
        moment = 201.0
        assert not guard.may("cell", "a", Right.DRIVE), "its time is over, whoever can be asked"
        db_server.start()
        other.revoke("cell")

        async def turned_away() -> bool:
            try:
                await guard.admit("10.0.0.7:1", bearer)
            except Unknown:
                return True
            return False

        async with asyncio.timeout(60.0):
            while not await turned_away():  # noqa: ASYNC110 - a thread follows the server
                await asyncio.sleep(0.02)
        guard.close()
        database.close()
    with open_trail(tmp_path, db_server.url) as trail:
        assert [entry for _, entry in trail.rows()] == [note(1)]


def said(caplog: pytest.LogCaptureFixture) -> set[str]:
    phrases = ("cannot write the audit yet", "cannot read the list")
    return {phrase for phrase in phrases for record in caplog.records if phrase in record.getMessage()}


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(60.0):
        while not condition():  # noqa: ASYNC110 - a thread follows the server
            await asyncio.sleep(0.02)


def test_rows_not_written_at_end_are_counted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    class Gone:
        def add(self, _: object) -> None:
            raise DatabaseError("nobody there")

    ended = Audit(Gone())
    ended.note(note(1))
    ended.close()
    assert caplog.records[-1].getMessage() == "1 rows of the audit are lost: nobody there"


def test_older_programs_files_are_brought_up_to_date(tmp_path: Path) -> None:
    """Files of the version before had the same tables, and no number of a version."""
    with open_trail(tmp_path) as trail:
        trail.add([note(1), note(2)])
    with contextlib.closing(open_store(tmp_path)) as store:
        store.allow("10.0.0.7", [Grant("a", SEE)])
    for name, added in ((FILE, "access_version"), (AUDIT, "audit_turn")):
        with contextlib.closing(sqlite3.connect(tmp_path / name, isolation_level=None)) as connection:
            triggers = connection.execute("SELECT name FROM sqlite_master WHERE type='trigger' AND tbl_name != 'audit'")
            for (trigger,) in triggers.fetchall():
                connection.execute(f"DROP TRIGGER {trigger}")
            connection.executescript(f"DROP TABLE {added}; PRAGMA user_version=0")
    with contextlib.closing(open_store(tmp_path)) as store:
        before = store.version
        store.allow("10.0.0.8", [])
        assert store.version > before
        assert [identity.name for identity in store.identities()] == ["10.0.0.7", "10.0.0.8"]
    with open_trail(tmp_path) as trail:
        trail.add([note(3)])
        assert trail.verify().number == 3


SCHEMA = resources.files("roboglot.storage.schema.postgresql")
VERSIONS = sorted(int(match[1]) for f in SCHEMA.iterdir() if (match := re.fullmatch(r"v(\d+)\.sql", f.name)))
COLUMNS = "SELECT table_name, column_name, data_type FROM information_schema.columns WHERE table_schema='public'"


def columns(url: str) -> set[object]:
    with psycopg.connect(url) as connection:
        return set(connection.execute(COLUMNS.encode()).fetchall())


@needs_postgresql
@pytest.mark.parametrize("before", VERSIONS[:-1])
def test_older_programs_database_is_brought_up_to_date(
    db_server: PostgreSQLServer, tmp_path: Path, before: int
) -> None:
    """From each earlier version, by two programs that start at the same time."""
    open_store(tmp_path, db_server.url).close()
    newest = columns(db_server.url)
    db_server.empty()
    with psycopg.connect(db_server.url, autocommit=True) as connection:
        connection.execute("CREATE TABLE roboglot_schema (version INTEGER PRIMARY KEY)")
        for version in VERSIONS[:before]:
            connection.execute((SCHEMA / f"v{version}.sql").read_text(encoding="utf-8").encode())
            connection.execute("INSERT INTO roboglot_schema VALUES (%s)", (version,))
        connection.execute("INSERT INTO cloud_account VALUES ('anna', 'x')")
    with ThreadPoolExecutor(2) as programs:
        one, two = programs.map(lambda _: open_store(tmp_path, db_server.url), range(2))
    with contextlib.closing(one), contextlib.closing(two):
        one.allow("10.0.0.7", [])
        assert len(two.identities()) == 1
    with psycopg.connect(db_server.url) as connection:
        applied = connection.execute("SELECT version FROM roboglot_schema ORDER BY version").fetchall()
        assert applied == [(version,) for version in VERSIONS]
        assert connection.execute("SELECT name FROM cloud_account").fetchall() == [("anna",)]
    assert columns(db_server.url) == newest
