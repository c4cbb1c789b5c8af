"""``roboglot connect --registry``: a client's address stays while its robot moves from program to program."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import httpx
import psycopg
import pytest

from roboglot.access.store import Grant, open_store
from roboglot.access.tunnel import dialling, heartbeat
from roboglot.access.tunnel.connector import NotTrusted
from roboglot.access.tunnel.dialling import Dialling
from roboglot.cli.connect import registered
from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, load_config
from roboglot.operations import Right
from roboglot.runtime import Runtime
from roboglot.storage import gateways
from roboglot.storage.opening import open_registry, read_registry
from roboglot.storage.robot_registry import RobotRegistry
from roboglot.testing.addresses import free_addresses
from tests.narrowing import known
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql

HERE, HOMES = free_addresses(1), (free_addresses(1), free_addresses(1))
NAME = "/api/core/system/v1/robot/info"


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    for limit in ("QUIET_AFTER", "LOST_AFTER"):
        monkeypatch.setattr(heartbeat, limit, 20.0)  # a busy machine must not look like a lost tunnel
    monkeypatch.setattr(dialling, "AGAIN_AFTER", 0.01)
    monkeypatch.setattr(dialling, "SOON", 0.01)
    monkeypatch.setattr(gateways, "PERIOD", 0.01)


@contextlib.asynccontextmanager
async def program(folder: Path, registry: str, address: str, token: str = "") -> AsyncIterator[tuple[Runtime, str]]:
    """Yield a program that runs robot a behind a gateway, and a token for it."""
    store = open_store(folder)
    token = token or store.add_machine("cell", [Grant("a", frozenset({Right.DRIVE}))])
    store.close()
    base = load_config(None, {"data": str(folder), "world": "empty", "lockstep": True, "registry": registry})
    access = AccessConfig(on=True, local=False, gateway="127.0.0.1:0")
    robots = (RobotConfig("a", "universal", address),)
    runtime = Runtime(replace(base, robots=robots, access=access, console=ConsoleConfig(enabled=False)))
    await runtime.start()
    try:
        yield runtime, token
    finally:
        await runtime.close()


def same_people(old: Path, new: Path) -> None:
    """Have the second program know the first one's clients."""
    with contextlib.closing(open_store(old)) as source, contextlib.closing(open_store(new)) as target:
        for identity in source.identities():
            target.put(identity)


class Client:
    """`roboglot connect` for robot a, and its output."""

    def __init__(self) -> None:
        self.said: asyncio.Queue[str] = asyncio.Queue()
        self.readies: asyncio.Queue[str] = asyncio.Queue()
        self._keeping: asyncio.Task[None]

    async def next(self, queue: asyncio.Queue[str]) -> str:
        """Return what comes next; raise what ended the client before."""
        coming = asyncio.ensure_future(queue.get())
        await asyncio.wait([coming, self._keeping], return_when=asyncio.FIRST_COMPLETED)
        if not coming.done():
            coming.cancel()
            await self._keeping
        return await coming

    @contextlib.asynccontextmanager
    async def connected(self, registry: str, token: str) -> AsyncIterator[asyncio.Task[None]]:
        def ready(robot: str, ports: list[int], fingerprint: str, new: bool) -> None:
            assert not new  # the registry knows the certificate
            self.readies.put_nowait(fingerprint)

        with registered(registry) as places:
            keeping = asyncio.ensure_future(Dialling(places, "a", token, HERE, ready, self.said.put_nowait).keep())
            self._keeping = keeping
            yield keeping
            keeping.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionError):
                await keeping


async def answers() -> bool:
    async with httpx.AsyncClient(base_url=f"http://{HERE}:1448", verify=False) as client:
        return (await client.get(NAME)).status_code == 200


async def test_client_follows_its_robot_to_the_next_program(tmp_path: Path) -> None:
    registry, client = str(tmp_path / "registry.db"), Client()
    async with contextlib.AsyncExitStack() as stack:
        async with program(tmp_path / "one", registry, HOMES[0]) as (_, token):
            await stack.enter_async_context(client.connected(registry, token))
            first = await client.next(client.readies)
            assert await answers()
            same_people(tmp_path / "one", tmp_path / "two")
        async with program(tmp_path / "two", registry, HOMES[1], token):
            second = await client.next(client.readies)
            assert second != first  # another data folder, another certificate
            assert await answers()


async def test_client_leaves_a_program_that_lost_its_robot(tmp_path: Path) -> None:
    """The old one lives on, cut off from the registry, and its tunnel too."""
    registry, client = str(tmp_path / "registry.db"), Client()
    async with program(tmp_path / "one", registry, HOMES[0]) as (old, token), client.connected(registry, token):
        await client.next(client.readies)
        renewals = known(old._registry_lease)._tasks[0]
        renewals.cancel()  # it would take its robot back within half a second
        await asyncio.wait([renewals])
        same_people(tmp_path / "one", tmp_path / "two")
        database = open_registry(registry)
        claims = RobotRegistry(database)
        await claims.release((await claims.all())["a"].holder, {"a": 1})
        async with program(tmp_path / "two", registry, HOMES[1], token):
            await client.next(client.readies)
            assert await client.next(client.said) == "robot a: it moved"
            assert await answers()
            assert (await claims.all())["a"].epoch == 2
        database.close()


async def test_only_certificate_that_the_registry_has_is_believed(tmp_path: Path) -> None:
    registry, client = str(tmp_path / "registry.db"), Client()
    async with program(tmp_path / "one", registry, HOMES[0]) as (runtime, token):
        database = open_registry(registry)
        claims = RobotRegistry(database)
        claim = (await claims.all())["a"]
        assert runtime._gateway is not None
        assert claim.gateway == f"127.0.0.1:{runtime._gateway.port}"
        await claims.announce(claim.holder, claim.gateway, "0" * 64)
        async with client.connected(registry, token) as keeping:
            with pytest.raises(NotTrusted, match="another certificate"):
                await keeping
        await claims.announce(claim.holder, "nonsense", claim.certificate)
        async with client.connected(registry, token) as keeping:
            assert "'nonsense'" in await client.next(client.said)
            assert not keeping.done()
        database.close()


@needs_postgresql
async def test_client_needs_only_the_right_to_read_claims(db_server: PostgreSQLServer) -> None:
    database = open_registry(db_server.url)
    assert await RobotRegistry(database).take({"a": "10.0.0.1"}, "one", {}) == {"a": 1}
    with psycopg.connect(db_server.url, autocommit=True) as connection:
        connection.execute("REVOKE CREATE ON SCHEMA public FROM PUBLIC")
        connection.execute("CREATE ROLE pupil LOGIN")
        connection.execute("GRANT SELECT ON robot_home TO pupil")
    url = db_server.url.replace("user=robots", "user=pupil")
    with contextlib.closing(read_registry(url)) as readable:
        found = await RobotRegistry(readable).of("a")
        assert found is not None
        assert found.address == "10.0.0.1"
    database.close()
