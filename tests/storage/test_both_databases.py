"""Everything that robots remember is kept alike in a file and on a PostgreSQL server."""

from __future__ import annotations

import asyncio
import io
import socket
from pathlib import Path
from typing import NoReturn

import httpx
import numpy as np
import psycopg
import pytest

from roboglot.config import Config, ConsoleConfig, RobotConfig
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.mapping.map_library import Label, StoredMap
from roboglot.model.components.system.disk import Disk
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.events import EventStream
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.programs.errors import StoreError
from roboglot.programs.stores import JournalEntry, LogEntry, StoredProgram
from roboglot.runtime import Runtime
from roboglot.storage import postgresql
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.apps import StoredApps
from roboglot.storage.files import StoredFiles
from roboglot.storage.journals import DatabaseJournalStore
from roboglot.storage.ledger import StoredLedger
from roboglot.storage.maps import StoredMaps
from roboglot.storage.members import StoredMembers
from roboglot.storage.opening import open_database
from roboglot.storage.outbox import Outbox
from roboglot.storage.places import StoredPlaces
from roboglot.storage.postgresql import PostgreSQL, in_one_line, is_exposed
from roboglot.storage.programs import DatabaseProgramStore
from roboglot.storage.settings import StoredSettings
from roboglot.storage.transactions import Connection, DatabaseError, DiskFull, Transactions
from roboglot.testing.addresses import free_addresses
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql

ODD = "naïve 狗\0 \ue000 '; DROP TABLE place; --"


class Room(Disk):
    """A disk with ``left`` bytes."""

    def __init__(self) -> None:
        self.left = 1_000_000

    @property
    def size(self) -> int:
        return 1_000_000

    @property
    def free(self) -> int:
        return self.left

    @property
    def uses(self) -> dict[str, int]:
        return {}

    def take(self, name: str, size: int) -> None: ...
    def release(self, name: str) -> None: ...


@pytest.fixture
def clock() -> LockstepClock:
    return LockstepClock()


async def test_settings_places_and_drawings(database: Transactions, clock: LockstepClock) -> None:
    events = EventStream()
    await StoredSettings(database, "a").put(ODD, {"x": ODD})
    await StoredSettings(database, "a").put("speed", 0.5)
    await StoredPlaces(database, "a", clock, events).put(
        PointOfInterest("z", Pose(1.0, 2.0, 0.3), {"name": ODD}), PointOfInterest("b", Pose())
    )
    await StoredAnnotations(database, "a", clock, events).change(lambda _: Annotations(last_id=7))
    settings, places = StoredSettings(database, "a"), StoredPlaces(database, "a", clock, events)
    assert (settings.get(ODD), settings.get("speed")) == ({"x": ODD}, 0.5)
    assert [place.id for place in places.all()] == ["z", "b"]  # in order of arrival
    assert (places.get("z").pose, dict(places.get("z").metadata)) == (Pose(1.0, 2.0, 0.3), {"name": ODD})
    assert StoredAnnotations(database, "a", clock, events).current.last_id == 7
    assert StoredSettings(database, "b").get("speed") is None


async def test_maps(database: Transactions) -> None:
    maps = StoredMaps(database, "a")
    grid = OccupancyGrid(np.arange(12, dtype=np.int8).reshape(3, 4), 0.05, Point(-1.0, 2.0))
    labels = (Label("kitchen", Point(1.0, 2.0), "room"),)
    await maps.put(StoredMap("floor", grid, 5.0, labels, outdoor=False, number=2**64 - 1, dock=Pose(1, 2, 3)))
    await maps.put(StoredMap("garden", grid, 6.0, (), outdoor=True, number=3))
    assert list(await maps.names()) == ["floor", "garden"]
    assert list(await maps.names(outdoor=True)) == ["garden"]
    assert list(await maps.names(number=2**64 - 1)) == ["floor"]
    kept = await maps.get("floor")
    assert (kept.labels, kept.dock, kept.number) == (labels, Pose(1, 2, 3), 2**64 - 1)
    assert (kept.grid.log_odds == grid.log_odds).all()
    await maps.remove("floor")
    with pytest.raises(NotFound):
        await maps.get("floor")


async def test_files_apps_and_members(database: Transactions, clock: LockstepClock) -> None:
    files = StoredFiles(database, "a", clock)
    await files.write(ODD, bytes(range(256)))
    await files.write(ODD, b"newer\0")
    assert (list(await files.names()), await files.read(ODD)) == ([ODD], b"newer\0")
    package = bytes(range(256)) * 8192  # three pieces
    await StoredApps(database, "a", clock, Room()).install("tour", "1.0", io.BytesIO(package))
    apps = StoredApps(database, "a", clock, Room())
    assert [(app.name, app.version, app.size) for app in apps.all()] == [("tour", "1.0", len(package))]
    query = "SELECT data FROM app_piece WHERE name='tour' ORDER BY number"
    pieces = await database.read(lambda connection: connection.execute(query).fetchall())
    assert b"".join(bytes(data) for (data,) in pieces) == package
    await apps.remove("tour")
    assert not StoredApps(database, "a", clock, Room()).all()
    members = StoredMembers(database, "a", clock, EventStream())
    await members.add("anna", host=True)
    await members.add("bo")
    await members.set_face("bo", b"\0face")
    with pytest.raises(InvalidGoal):
        await members.rename("bo", "anna")
    again = StoredMembers(database, "a", clock, EventStream())
    assert [(m.name, m.host, m.face) for m in again.all()] == [("anna", True, None), ("bo", False, b"\0face")]


async def test_two_that_add_the_same_member(database: Transactions, clock: LockstepClock) -> None:
    one, other = (StoredMembers(database, "a", clock, EventStream()) for _ in range(2))
    await one.add("anna")
    with pytest.raises(InvalidGoal, match="already"):
        await other.add("anna")


async def test_programs_journals_ledger_and_outbox(database: Transactions) -> None:
    tasks = DatabaseProgramStore(database, "a")
    program = StoredProgram("t1", "describes", ODD, "single", "now", "print(1)", "wait_run", 12.5, "anna")
    await tasks.put(program, uses=["m1", "m2"])
    await tasks.put(program)
    await tasks.set_state("t1", "run", [LogEntry(1.0, "print", ODD)])
    kept = await tasks.get("t1")
    assert kept is not None
    assert (kept.style, kept.due, kept.owner, kept.state) == (ODD, 12.5, "anna", "run")
    assert await tasks.log("t1") == [LogEntry(1.0, "print", ODD)]
    assert await tasks.uses("t1") == ["m1", "m2"]
    assert [listed.id for listed in await tasks.all()] == ["t1"]
    assert [p.id for p in tasks.in_states_now(["run"])] == ["t1"]
    assert tasks.in_states_now([]) == []
    assert await tasks.count() == 1
    journals = DatabaseJournalStore(database, "a")
    await journals.begin("t1", "{}")
    await asyncio.gather(*(journals.write("t1", [JournalEntry(n, "turn", None)]) for n in range(20)))
    await journals.write("t1", [JournalEntry(3, "turn", b"done\0")])
    entries = await journals.entries("t1")
    assert [entry.seq for entry in entries] == list(range(20))
    assert entries[3].answer == b"done\0"
    ledger = StoredLedger(database, "a")
    await ledger.write("order", {"2": {"to": ODD}, "1": {}})
    await ledger.write("order", {"3": {}}, forget=["1"])
    assert list(ledger.all("order")) == [("2", {"to": ODD}), ("3", {})]
    outbox = Outbox(database, "a")
    await outbox.put("first")
    await outbox.put("second")
    number, document = await outbox.first() or (0, "")
    await outbox.remove(number)
    assert (document, (await outbox.first() or (0, ""))[1]) == ("first", "second")


async def test_a_failed_work_leaves_nothing(database: Transactions) -> None:
    def half(connection: Connection) -> None:
        connection.execute("INSERT INTO setting (robot, key, value) VALUES (?, ?, ?)", ("a", "x", "1"))
        connection.execute("SELECT * FROM nothing_of_this_name")

    with pytest.raises(DatabaseError):
        await database.run(half)
    assert StoredSettings(database, "a").get("x") is None


async def test_a_full_disk_is_only_read(database: Transactions) -> None:
    room = Room()
    own = database.on(room)
    await StoredSettings(own, "a").put("x", 1)
    await StoredLedger(own, "a").write("kind", {"first": 1})
    room.left = 0
    with pytest.raises(DiskFull):
        await StoredSettings(own, "a").put("x", 2)
    with pytest.raises(StoreError):
        await Outbox(own, "a").put("more")
    assert StoredSettings(own, "a").get("x") == 1
    ledger = StoredLedger(own, "a")
    with pytest.raises(DiskFull):
        await ledger.write("kind", {"second": 2}, forget=["first"])
    await ledger.write("kind", {}, forget=["first"])
    assert ledger.all("kind") == []
    await StoredSettings(database, "b").put("x", 3)  # another robot's disk has room


def test_an_error_of_the_server_is_one_line() -> None:
    error = psycopg.OperationalError("connection failed: Connection refused\n\tIs the server running?")
    assert in_one_line(error) == "connection failed: Connection refused Is the server running?"


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://bob:S3cret@[bad/x",
        "postgresql://bob:p@S3cret@localhost:1/x",
        "postgresql://bob:50%zzS3cret@localhost:1/x",
        "postgresql://localhost:1/x?password=%zzS3cret",
    ],
)
def test_errors_of_bad_urls_show_no_password(monkeypatch: pytest.MonkeyPatch, url: str) -> None:
    """libpq repeats a URL that it cannot read, and a part of a password with an @ as the host's name."""

    def resolve(*_: object, **__: object) -> NoReturn:
        raise OSError("it resolves nothing")

    monkeypatch.setattr(socket, "getaddrinfo", resolve)
    with pytest.raises(OSError, match=r"URI|resolve|percent") as raised:
        PostgreSQL(url)
    assert "S3cret" not in str(raised.value)


@pytest.mark.parametrize(
    ("address", "mode", "exposed"),
    [
        ("", "prefer", False),
        ("127.0.0.1", "disable", False),
        ("::1", "prefer", False),
        ("192.0.2.7", "prefer", True),
        ("fe80::1%eth0", "require", True),
        ("192.0.2.7", "verify-full", False),
    ],
)
def test_only_a_checked_certificate_protects(address: str, mode: str, exposed: bool) -> None:
    assert is_exposed(address, mode) is exposed


@needs_postgresql
async def test_exposed_database_is_logged(
    db_server: PostgreSQLServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(postgresql, "is_exposed", lambda *where: where == ("", "allow"))
    PostgreSQL(f"{db_server.url}&sslmode=allow").close()
    assert postgresql.EXPOSED in caplog.messages


@pytest.mark.slow
@needs_postgresql
async def test_clients_see_no_host_of_the_database(
    db_server: PostgreSQLServer, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(postgresql.limited_log, "_said", {})
    database = open_database(tmp_path / "unused", db_server.url, ["a"])
    settings = StoredSettings(database, "a")
    db_server.stop()
    try:
        with pytest.raises(DatabaseError) as failed:
            await settings.put("x", 1)
    finally:
        db_server.start()
    host = db_server.url.partition("host=")[2].partition("&")[0]
    assert str(failed.value) == "the database cannot be reached"
    assert host in caplog.text
    with pytest.raises(DatabaseError) as failed:
        await database.run(lambda connection: connection.execute("SELECT secret FROM password"))
    assert str(failed.value) == "the database failed"
    database.close()


@needs_postgresql
async def test_a_robot_is_served_once(
    db_server: PostgreSQLServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(postgresql, "CLAIM_MAX", 1)
    one = open_database(tmp_path / "unused", db_server.url, ["a", "b"])
    with pytest.raises(OSError, match="robot b is served by another program"):
        open_database(tmp_path / "unused", db_server.url, ["b", "c"])
    other = open_database(tmp_path / "unused", db_server.url, ["c"])
    other.close()
    one.close()
    open_database(tmp_path / "unused", db_server.url, ["b", "c"]).close()


@pytest.mark.slow
@needs_postgresql
async def test_start_waits_for_a_dying_programs_robots(
    db_server: PostgreSQLServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shard that Ray starts before the server has noticed the old machine's end need not start twice."""
    monkeypatch.setattr(postgresql, "CLAIM_MAX", 9000)
    old = open_database(tmp_path / "unused", db_server.url, ["a", "b"])
    starting = asyncio.create_task(asyncio.to_thread(open_database, tmp_path / "unused", db_server.url, ["b"]))
    waiting = "SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND NOT granted"
    with psycopg.connect(db_server.url, autocommit=True) as connection:
        while not starting.done() and connection.execute(waiting).fetchone() != (1,):  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    assert not starting.done()
    old.close()
    new = await starting
    await StoredSettings(new, "b").put("who", "new")
    db_server.stop()  # its robots are another's when it comes back
    db_server.start()
    third = open_database(tmp_path / "unused", db_server.url, ["b"])
    monkeypatch.setattr(postgresql, "CLAIM_MAX", 1)
    with pytest.raises(DatabaseError, match="served by another program"):
        await StoredSettings(new, "b").put("who", "new again")
    third.close()
    new.close()


@needs_postgresql
async def test_program_that_lost_a_robot_writes_nothing(db_server: PostgreSQLServer, tmp_path: Path) -> None:
    first = open_database(tmp_path / "unused", db_server.url, ["a"])
    settings = StoredSettings(first, "a")
    await settings.put("who", "first")
    db_server.stop()  # all connections break
    db_server.start()
    second = open_database(tmp_path / "unused", db_server.url, ["a"])
    await StoredSettings(second, "a").put("who", "second")
    with pytest.raises(DatabaseError, match="served by another program"):
        await settings.put("who", "first again")
    assert StoredSettings(second, "a").get("who") == "second"
    second.close()
    await settings.put("who", "first again")  # the robot is free: it is claimed again
    first.close()


@needs_postgresql
async def test_robot_moves_to_another_folder_with_its_places(db_server: PostgreSQLServer, tmp_path: Path) -> None:
    poi = {"id": "door", "pose": {"x": 1.0, "y": 2.0, "yaw": 0.0}, "metadata": {"display_name": "狗"}}
    for life in ("one machine", "another"):
        robot = RobotConfig("a", address=(address := free_addresses(1)))
        runtime = Runtime(
            Config(
                "empty",
                (robot,),
                lockstep=True,
                data=tmp_path / life,
                database=db_server.url,
                console=ConsoleConfig(enabled=False),
            )
        )
        await runtime.start()
        async with httpx.AsyncClient(base_url=f"http://{address}:1448", verify=False) as client:
            if life == "one machine":
                assert (await client.post("/api/core/artifact/v1/pois", json=poi)).status_code == 200
            pois = (await client.get("/api/core/artifact/v1/pois")).json()
        await runtime.close()
        assert [kept["id"] for kept in pois] == ["door"]
