"""A PostgreSQL server that hangs or cannot be reached keeps no work waiting."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from pathlib import Path
from typing import Any, NoReturn

import psycopg
import pytest

from roboglot.hosting.steady_time import uptime
from roboglot.storage import postgresql, postgresql_connection
from roboglot.storage.opening import open_database
from roboglot.storage.postgresql_connection import LimitedConnection, Patience
from roboglot.storage.settings import StoredSettings
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql

UNREACHABLE = {"the database cannot be reached"}


def ten_saves(settings: StoredSettings) -> asyncio.Future[list[BaseException | None]]:
    """Ask for ten saves at once, whose errors are their results."""
    return asyncio.gather(*(settings.put("x", number) for number in range(10)), return_exceptions=True)


@needs_postgresql
async def test_silent_server_fails_what_waits_for_it(
    db_server: PostgreSQLServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A server that hangs keeps its connections, and takes new ones: only a time limit shows it."""
    database = open_database(tmp_path / "unused", db_server.url)
    settings = StoredSettings(database, "a")
    await settings.put("x", 1)
    with psycopg.connect(db_server.url, autocommit=True) as connection:
        ours = connection.execute("SELECT pid FROM pg_stat_activity WHERE application_name='roboglot'").fetchall()
    for (process,) in ours:
        os.kill(process, signal.SIGSTOP)
    monkeypatch.setattr(Patience, "answer_max", 0.2)
    monkeypatch.setattr(postgresql, "connect", lambda *_: (_ for _ in ()).throw(psycopg.OperationalError("silence")))
    try:
        saving = ten_saves(settings)
        await asyncio.wait([saving], timeout=30.0)
        assert saving.done()
        assert {str(failed) for failed in saving.result()} == UNREACHABLE
    finally:
        monkeypatch.undo()
        for (process,) in ours:
            os.kill(process, signal.SIGCONT)
    await settings.put("x", 3)
    assert StoredSettings(database, "a").get("x") == 3
    database.close()


@needs_postgresql
async def test_work_that_waits_shares_a_failed_connection(
    db_server: PostgreSQLServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the tenth of ten would wait ten times as long as it takes to see that a server gives no answer."""
    database = open_database(tmp_path / "unused", db_server.url, ["a"])
    settings = StoredSettings(database, "a")
    await settings.put("x", 1)
    tries, all_wait = list[str](), threading.Event()

    def fail(url: str, _: type) -> NoReturn:
        tries.append(url)
        all_wait.wait(30.0)
        raise psycopg.OperationalError("no answer")

    db_server.stop()
    try:
        with monkeypatch.context() as patch:
            patch.setattr(postgresql, "connect", fail)
            saving = ten_saves(settings)
            await asyncio.sleep(0)  # all are asked for
            all_wait.set()
            assert {str(failed) for failed in await saving} == UNREACHABLE
    finally:
        db_server.start()
    assert len(tries) == 1
    await settings.put("x", 3)
    database.close()


@needs_postgresql
async def test_closing_waits_little_for_silent_servers(
    db_server: PostgreSQLServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C came while a connection was renewed: that took five seconds more, and each work behind it as well."""
    database = open_database(tmp_path / "unused", db_server.url)
    settings = StoredSettings(database, "a")
    await settings.put("x", 1)
    monkeypatch.setattr(postgresql_connection, "CLOSE_MAX", 0.2)
    connecting = threading.Event()

    def connect(*given: Any) -> LimitedConnection:
        connecting.set()
        return postgresql_connection.connect(*given)

    monkeypatch.setattr(postgresql, "connect", connect)
    with psycopg.connect(db_server.url, autocommit=True) as connection:
        ends = "SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity WHERE application_name='roboglot'"
        connection.execute(ends)
        with db_server.hanging():
            saving = ten_saves(settings)
            await asyncio.to_thread(connecting.wait, 30.0)
            began = uptime()
            await asyncio.to_thread(database.close)
            assert {str(failed) for failed in await saving} == UNREACHABLE
            assert uptime() - began < postgresql_connection.CONNECT_MAX / 2
