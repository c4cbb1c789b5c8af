"""Access by known proofs only, and its end when a right ends: through real doors."""

from __future__ import annotations

import asyncio
import sqlite3
import subprocess
import sys
import threading
import time
from base64 import b64encode
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.access import proofs
from roboglot.access.guard import Guard
from roboglot.access.secrets import password_fits
from roboglot.access.store import AccessStore, Grant, open_store
from roboglot.access.trail import FILE, BrokenChain, open_trail
from roboglot.config import AccessConfig
from roboglot.model.admission import NO_PROOF, Proof, ProofKind, Unknown
from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.lease import Lease
from roboglot.operations import Right
from roboglot.runtime import Runtime
from tests.access.matrix import ADDRESS, CALLERS, TextCaller, open_frames

REST = f"http://{ADDRESS}:1448"
POSE, ACTIONS = "/api/core/slam/v1/localization/pose", "/api/core/motion/v1/actions"
GO = {"action_name": "slamtec.agent.actions.MoveToAction", "options": {"target": {"x": 3.0, "y": 0.0}}}
SEE, DRIVE = frozenset({Right.SEE}), frozenset({Right.DRIVE})
DRIVER = next(caller for caller in CALLERS if caller.name == "drive")


def guard_of(runtime: Runtime):
    assert runtime.guard is not None
    return runtime.guard


def within_a_minute(runtime: Runtime, monkeypatch: pytest.MonkeyPatch) -> None:
    """Count all tries to come within the same minute, however long a busy machine takes for them."""
    monkeypatch.setattr(guard_of(runtime)._proofs._tries, "_now", time.monotonic().__float__)


async def status(auth: httpx.Auth | tuple[str, str] | None = None, **headers: str) -> int:
    async with httpx.AsyncClient(verify=False, base_url=REST, auth=auth, headers=headers) as client:
        return (await client.get(POSE)).status_code


async def test_only_known_tokens_and_passwords_let_in(runtime: Runtime, store: AccessStore) -> None:
    token = store.add_machine("cell", [Grant("a", SEE)])
    store.add_person("anna", "correct horse", [Grant("*", SEE)])
    guard_of(runtime).reload()
    assert await status() == 401
    assert await status(authorization=f"Bearer {token}") == 200
    assert await status(("cell", token)) == 200  # for clients that can only send names and passwords
    assert await status(("anna", "correct horse")) == 200
    assert await status(("anna", "wrong horse")) == 401
    assert await status(authorization="Bearer x") == 401
    assert await status(("anna", "correct horse")) == 200  # cached by now
    assert await status(("cell", token)) == 200
    assert await status(authorization=token) == 401  # the third wrong one
    assert await status(("anna", "another horse")) == 401  # no longer checked
    guard_of(runtime).reload()
    assert await status(("anna", "correct horse")) == 401  # a right guess looks like any other
    assert await status(("cell", token)) == 200
    other = store.add_machine("other", [Grant("a", SEE)])
    guard_of(runtime).reload()
    assert await status(authorization=f"Bearer {other}") == 200  # tokens cannot be guessed
    store.rotate("anna", "better horse")
    guard_of(runtime).reload()
    assert await status(("anna", "correct horse")) == 401


async def first_line(port: int, path: str, proof: bytes) -> bytes:
    """First line of the answer to a request that a REST door and a WebSocket understand; empty: the line was cut."""
    reader, writer = await asyncio.open_connection(ADDRESS, port)
    head = f"GET {path} HTTP/1.1\r\nHost: {ADDRESS}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    key = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    writer.write(f"{head}{key}Authorization: ".encode() + proof + b"\r\n\r\n")
    try:
        async with asyncio.timeout(10):
            return await reader.readline()
    finally:
        writer.close()


async def test_a_proof_that_is_no_text_is_refused(runtime: Runtime, caplog: pytest.LogCaptureFixture) -> None:
    for proof in (b"Basic \xe9", b"Basic \xff==", b"Basic /w==", b"Bearer \xe9", b"\xe9"):
        for port, path in ((1448, POSE), (50053, "/programs")):
            assert b" 401 " in await first_line(port, path, proof), (port, proof)
    assert not [record.message for record in caplog.records if record.levelname == "ERROR"]


async def test_a_failed_check_ends_the_opening(runtime: Runtime, monkeypatch: pytest.MonkeyPatch) -> None:
    async def fail(*_: object) -> str:
        raise OSError("the list cannot be read")

    monkeypatch.setattr(guard_of(runtime), "admit", fail)
    assert await first_line(50053, "/programs", b"Bearer x") == b""


async def test_address_is_allowed_in_each_of_its_forms(runtime: Runtime, store: AccessStore) -> None:
    for given, peers in (
        ("::ffff:127.0.95.77", ["127.0.95.77:4242", "[::ffff:127.0.95.77]:4242", "ipv6:%5B::ffff:127.0.95.77%5D:4242"]),
        ("2001:DB8:0::7", ["[2001:db8::7]:4242"]),
    ):
        name = store.allow(given, [Grant("a", SEE)])
        guard_of(runtime).reload()
        assert [guard_of(runtime).cached_identity(peer, NO_PROOF) for peer in peers] == [name] * len(peers)


async def test_guessing_is_stopped_and_costs_nothing(
    runtime: Runtime, store: AccessStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.add_person("anna", "correct horse", [Grant("*", SEE)])
    guard_of(runtime).reload()
    checked: list[str] = []  # each takes 50 ms of a processor

    def fits(password: str, kept: str) -> bool:
        checked.append(password)
        return password_fits(password, kept)

    monkeypatch.setattr(proofs, "password_fits", fits)
    within_a_minute(runtime, monkeypatch)
    async with httpx.AsyncClient(verify=False, base_url=REST) as client:
        for number in range(100):
            reply = await client.get(POSE, auth=("anna", f"guess {number}"))
            assert reply.status_code == 401
    assert "too many wrong" in reply.text
    assert checked == ["guess 0", "guess 1", "guess 2"]


async def test_many_tries_at_once_count_one_by_one(
    runtime: Runtime, store: AccessStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    within_a_minute(runtime, monkeypatch)
    store.add_person("anna", "correct horse", [Grant("*", SEE)])
    guard_of(runtime).reload()
    async with httpx.AsyncClient(verify=False, base_url=REST) as client:
        tries = [client.get(POSE, auth=("anna", f"guess {number}")) for number in range(30)]
        replies = await asyncio.gather(*tries)
    assert sum("is not valid" in reply.text for reply in replies) == 3


async def test_a_revoked_driver_stops_at_once(runtime: Runtime, store: AccessStore) -> None:
    robot, clock = runtime.fleet.robots["a"], runtime.clock
    assert isinstance(clock, LockstepClock)
    client = await TextCaller.open(DRIVER.address)
    assert [await client.ask(text) for text in ("command", "chassis speed x 0.5")] == [b"ok;", b"ok;"]
    [action] = robot.actions.running()
    assert action.identity == DRIVER.address
    store.revoke(DRIVER.address)
    guard_of(runtime).reload()
    await clock.advance(1.0)
    assert action.status.ended
    assert await client.ask("chassis speed x 0.5") == b""
    client.close()
    client = await TextCaller.open(DRIVER.address)
    assert await client.ask("command") == b""
    client.close()


@pytest.mark.parametrize(
    ("who", "stays"),
    [
        ("slamware stranger", False),
        ("robomaster 10.1.2.3:40000", False),
        (f"robomaster {DRIVER.address}:40000", True),
        ("robomaster", True),
        ("a person", True),
    ],
)
async def test_control_kept_over_a_restart_needs_the_right(runtime: Runtime, who: str, stays: bool) -> None:
    lease = runtime.fleet.robots["a"][Lease]
    await lease.take(who)
    for admission in guard_of(runtime)._admissions:
        admission.settle_control()  # as at every start
    await asyncio.sleep(0)
    assert lease.taken_by == (who if stays else "")
    await lease.release()


async def test_one_address_has_so_many_connections(runtime: Runtime) -> None:
    admission = runtime.fleet.robots["a"].admission
    admission.connections_max = 3
    clients = [await TextCaller.open(DRIVER.address) for _ in range(4)]
    assert [await client.ask("version") for client in clients[:3]].count(b"") == 0
    assert await clients[3].ask("version") == b""
    for client in clients:
        client.close()


async def test_a_right_ends_with_its_time(runtime: Runtime, store: AccessStore) -> None:
    guard, moment = guard_of(runtime), time.time()
    guard.now = lambda: moment
    token = store.add_machine("guest", [Grant("a", DRIVE, moment + 60.0)])
    guard.reload()
    async with httpx.AsyncClient(verify=False, base_url=REST, headers={"authorization": f"Bearer {token}"}) as client:
        assert (await client.post(ACTIONS, json=GO)).status_code == 200
        [action] = runtime.fleet.robots["a"].actions.running()
        moment += 61.0
        await until(lambda: action.status.ended or action.status.name == "CANCELING")
        assert (await client.post(ACTIONS, json=GO)).status_code == 403


async def test_another_program_revokes_within_a_second(runtime: Runtime, data: Path) -> None:
    link = await open_frames(CALLERS[1].address)
    assert link is not None
    other = open_store(data)
    other.revoke(CALLERS[1].address)
    other.close()
    async with asyncio.timeout(60):
        async for _ in link:
            pass
    await link.close()
    assert await open_frames(CALLERS[1].address) is None


def test_a_change_is_found_at_the_next_look(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Counts looks instead of seconds: the one after a change finds it, and two are less than a second apart."""
    guard, other = Guard(data, AccessConfig(on=True), {}), open_store(data)
    looks: list[float] = []
    found_at: list[int] = []

    class Wanted(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            looks.append(timeout or 0.0)
            if len(looks) == 3:
                other.add_machine("cell", [Grant("a", DRIVE)])
            return False

    class Ended(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            return bool(found_at) or len(looks) > 20 or timeout is None

    class Loop:
        def call_soon_threadsafe(self, reload: Callable[[], None]) -> None:
            found_at.append(len(looks))
            reload()

    monkeypatch.setattr(guard, "_ended", Ended())
    monkeypatch.setattr(guard, "_wanted", Wanted())
    loop: Any = Loop()
    guard._follow(loop)
    assert found_at == [3]
    assert 2 * looks[2] < 1.0
    guard._ended = threading.Event()
    guard.close()
    other.close()


async def test_token_made_just_now_is_valid_at_once(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("LOOK_PERIOD", "LOOK_MAX"):
        monkeypatch.setattr(f"roboglot.access.guard.{name}", 1000.0)
    guard, other = Guard(data, AccessConfig(on=True), {}), open_store(data)
    guard.start()
    try:
        token = other.add_machine("cell", [Grant("a", DRIVE)])
        bearer = Proof(ProofKind.HTTP, f"Bearer {token}")
        assert await guard.admit("10.0.0.7:1", bearer) == "cell"
        other.add_person("eve", "correct horse", [])
        basic = Proof(ProofKind.HTTP, f"Basic {b64encode(b'eve:correct horse').decode()}")
        assert await guard.admit("10.0.0.7:1", basic) == "eve"
        with pytest.raises(Unknown):
            await guard.admit("10.0.0.7:1", Proof(ProofKind.HTTP, f"Bearer {token}x"))
    finally:
        guard.close()
        other.close()


async def test_audit_keeps_changes_and_refusals_without_secrets(
    runtime: Runtime, store: AccessStore, data: Path
) -> None:
    secrets = [store.add_machine("cell", [Grant("a", DRIVE)]), "a wrong password"]
    guard_of(runtime).reload()
    async with httpx.AsyncClient(
        verify=False, base_url=REST, headers={"authorization": f"Bearer {secrets[0]}"}
    ) as client:
        await client.get(POSE)
        await client.post(ACTIONS, json=GO)
        await client.delete("/api/core/slam/v1/maps")
        await client.get(POSE, auth=("anna", secrets[1]))
    guard_of(runtime).audit.close()
    with open_trail(data) as trail:
        rows = [entry[1:2] + entry[4:7] for _, entry in trail.rows()]
        assert trail.verify().number == 3
    assert rows == [
        ("cell", "slamware", f"POST {ACTIONS}", "done"),
        ("cell", "slamware", "DELETE /api/core/slam/v1/maps", "refused"),
        ("", "", "", "turned away"),
    ]
    for path in filter(Path.is_file, sorted(data.rglob("*"))):  # noqa: ASYNC240
        assert not any(secret.encode() in path.read_bytes() for secret in secrets), path


async def test_audit_keeps_changes_by_the_console(runtime: Runtime, store: AccessStore, data: Path) -> None:
    token, seer = store.add_machine("cell", [Grant("a", DRIVE)]), store.add_machine("eye", [Grant("a", SEE)])
    teacher = store.add_machine("boss", [Grant("*", frozenset({Right.ADMIN}))])
    guard_of(runtime).reload()
    assert runtime.console is not None
    await runtime.console.ready()
    async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{runtime.console.port}/api/", verify=False) as client:

        async def ask(who: str, path: str, **values: object) -> int:
            reply = await client.post(path, json=values, headers={"authorization": f"Bearer {who}"})
            return reply.status_code

        assert await ask(token, "robots/a/take_control") == 200
        assert await ask(token, "robots/a/maps") == 200  # changes nothing
        assert await ask(token, "robots/a/go_to", points=[]) >= 400
        assert await ask(seer, "robots/a/release_control") == 403
        assert await ask(token, "class", do="open") == 403
        assert await ask(teacher, "class", do="open", name="7b") == 200
    guard_of(runtime).audit.close()
    with open_trail(data) as trail:
        rows = [(entry.who, entry.operation, entry.outcome) for _, entry in trail.rows()]
    assert [row for row in rows if row[1] != "go_to"] == [
        ("cell", "take_control", "done"),
        ("eye", "release_control", "refused"),
        ("cell", "class", "refused"),
        ("boss", "class open", "done"),
    ]


@pytest.mark.parametrize("taken", ["console cell", "slamware cell", "robomaster cell:4242"])
async def test_control_goes_with_the_right(runtime: Runtime, store: AccessStore, taken: str) -> None:
    robot = runtime.fleet.robots["a"]
    for name in ("cell", "cellar"):
        store.add_machine(name, [Grant("a", DRIVE)])
    guard_of(runtime).reload()
    await robot[Lease].take(taken)
    store.revoke("cellar")
    guard_of(runtime).reload()
    await asyncio.sleep(0)
    assert robot[Lease].taken_by == taken
    store.revoke("cell")
    guard_of(runtime).reload()
    await until(lambda: not robot[Lease].taken_by)


async def until(condition) -> None:
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110 - a thread looks at the clock
            await asyncio.sleep(0.02)


def test_the_audit_survives_a_kill_and_shows_changes(tmp_path: Path) -> None:
    code = (
        "# warm\nimport sys, os, time; from pathlib import Path; from roboglot.access.audit import Audit\n"
        "from roboglot.access.trail import Entry, open_trail\n"
        "trail = open_trail(Path(sys.argv[1])); audit = Audit(trail)\n"
        "for n in range(50): audit.note(Entry(float(10 * n), 'anna', '', 'a', 'slamware', f'op {n}', 'done'))\n"
        "while len(list(trail.rows())) < 50: time.sleep(0.01)\n"
        "os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", code, str(tmp_path)], timeout=180, check=False).returncode == -9
    with open_trail(tmp_path) as trail:
        assert trail.verify().number == 50
        with closing(sqlite3.connect(tmp_path / FILE, isolation_level=None)) as connection:
            with pytest.raises(sqlite3.Error, match="the audit stays"):
                connection.execute("DELETE FROM audit WHERE number = 7")
            connection.executescript("DROP TRIGGER audit_stays; UPDATE audit SET who='bert' WHERE number = 7")
        with pytest.raises(BrokenChain, match="row 7"):
            trail.verify()
