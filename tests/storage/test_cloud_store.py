"""The cloud's store on SQLite and on a real PostgreSQL: the same behaviour on both."""

from __future__ import annotations

import asyncio
from pathlib import Path

import psycopg
import pytest

from roboglot.storage import cloud
from roboglot.storage.cloud import CloudStore, TooMany
from roboglot.storage.postgresql import PostgreSQL
from roboglot.storage.transactions import DatabaseError, Transactions
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql


@pytest.fixture
def store(database: Transactions) -> CloudStore:
    return CloudStore(database)


async def test_token_opens_its_account_until_replaced(store: CloudStore) -> None:
    token = await store.add_account("class 7b")
    assert await store.account_of(token) == "class 7b"
    assert await store.account_of("another") is None
    newer = await store.add_account("class 7b")
    assert (await store.account_of(token), await store.account_of(newer)) == (None, "class 7b")
    with pytest.raises(ValueError, match="1 to 64"):
        await store.add_account(" ")


async def test_favourites_are_sorted_by_bytes_and_outlive_robots(store: CloudStore) -> None:
    for account in ("one", "two"):
        await store.add_account(account)
    for id in ("b", "B", "_a", "é", "张三"):
        await store.save("one", "task", id, f"the {id}")
        assert await store.set_favourite("one", "task", id, favourite=True)
    await store.save("one", "task", "plain", "?")
    assert not await store.set_favourite("one", "module", "b", favourite=True)
    assert not await store.set_favourite("two", "task", "b", favourite=True)
    await store.save("one", "task", "b", "100 % of b's second")
    await store.delete("one", "task", ["b", "plain", "no one's"])
    expected = ["the B", "the _a", "100 % of b's second", "the é", "the 张三"]
    assert await store.favourites("one", "task", []) == expected
    assert await store.favourites("one", "task", ["B", "é"]) == [expected[1], expected[2], expected[4]]
    assert not await store.set_favourite("one", "task", "plain", favourite=True)
    assert await store.set_favourite("one", "task", "b", favourite=False)
    assert "100 % of b's second" not in await store.favourites("one", "task", [])
    assert await store.favourites("two", "task", []) == []


async def test_programs_beyond_the_limit_are_refused(store: CloudStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cloud, "PROGRAMS_MAX", 2)
    monkeypatch.setattr(cloud, "RECORDS_MAX", 3)
    for account in ("one", "two"):
        await store.add_account(account)
    await store.save("one", "task", "a", "A")
    await store.save("one", "task", "b", "B")
    with pytest.raises(TooMany):
        await store.save("one", "task", "c", "C")
    assert not await store.set_favourite("one", "task", "c", favourite=True)
    await store.save("one", "task", "b", "again")
    for number in range(5):
        await store.record("one", "dog", f"{number}")
    await store.record("two", "cat", "other")
    assert await store.records("one", 100) == [("dog", "2"), ("dog", "3"), ("dog", "4")]
    assert await store.records("one", 1) == [("dog", "4")]
    assert await store.records("two", 100) == [("cat", "other")]


async def test_many_at_once_lose_nothing(store: CloudStore) -> None:
    await store.add_account("one")
    await asyncio.gather(*(store.record("one", f"robot {number}", f"{number}") for number in range(60)))
    assert sorted(int(document) for _, document in await store.records("one", 100)) == list(range(60))


@pytest.mark.slow
@needs_postgresql
async def test_a_restart_of_the_server_is_survived(db_server: PostgreSQLServer) -> None:
    database = PostgreSQL(db_server.url)
    store = CloudStore(database)
    token = await store.add_account("one")
    db_server.stop()
    with pytest.raises(DatabaseError):
        await store.record("one", "dog", "lost, and said so")
    db_server.start()
    for number in range(8):
        await store.record("one", "dog", f"{number}")
    assert [document for _, document in await store.records("one", 100)] == [f"{number}" for number in range(8)]
    assert await store.account_of(token) == "one"
    database.close()


@needs_postgresql
def test_newer_formats_are_left_untouched(db_server: PostgreSQLServer) -> None:
    PostgreSQL(db_server.url).close()
    PostgreSQL(db_server.url).close()  # nothing is created twice
    with psycopg.connect(db_server.url) as connection:
        connection.execute("INSERT INTO roboglot_schema VALUES (99)")
    with pytest.raises(ValueError, match="of version 99"):
        PostgreSQL(db_server.url)


def test_unreachable_server_is_reported_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="connection") as expected:
        PostgreSQL(f"postgresql:///robots?host={tmp_path}")
    assert "\n" not in str(expected.value)
