"""A runtime in lockstep whose robot has access control."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from roboglot.access.store import AccessStore, Grant, open_store
from roboglot.access.tunnel import heartbeat
from roboglot.access.tunnel.frames import HEAD, FrameKind
from roboglot.config import AccessConfig, RobotConfig, load_config
from roboglot.operations import Right
from roboglot.runtime import Runtime
from tests.access.matrix import ADDRESS, CALLERS


@pytest.fixture
def data(tmp_path: Path) -> Path:
    return tmp_path / "data"


@pytest.fixture
def store(data: Path) -> AccessStore:
    """The access list with the matrix's callers, by address and as apps."""
    store = open_store(data)
    for caller in CALLERS:
        robot = "b" if caller.name == "owner-of-b" else "a"
        rights = [Right.ADMIN] if caller.name in ("owner-of-b", "revoked") else [Right(caller.name)]\
            if caller.name != "unknown" else []  # fmt: skip
        if rights:
            store.allow(caller.address, [Grant(robot, frozenset(rights))])
            store.add_app(caller.name, [Grant(robot, frozenset(rights))])
    store.revoke("revoked")
    store.revoke(next(caller.address for caller in CALLERS if caller.name == "revoked"))
    return store


@pytest.fixture
async def runtime(data: Path, store: AccessStore) -> AsyncIterator[Runtime]:
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    access = AccessConfig(on=True, local=False, requests=1_000_000, connections=1000, logins=3)
    runtime = Runtime(replace(base, robots=(RobotConfig("a", "universal", ADDRESS),), access=access))
    await runtime.start()
    yield runtime
    await runtime.close()
    store.close()


@pytest.fixture
async def gateway(data: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[tuple[Runtime, str]]:
    """A robot behind a gateway, and a token that drives it."""
    for limit in ("QUIET_AFTER", "LOST_AFTER"):
        monkeypatch.setattr(heartbeat, limit, 20.0)  # a busy machine must not look like a lost tunnel
    store = open_store(data)
    token = store.add_machine("cell", [Grant("a", frozenset({Right.DRIVE}))])
    store.close()
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    access = AccessConfig(on=True, local=False, gateway="127.0.0.1:0")
    runtime = Runtime(replace(base, robots=(RobotConfig("a", "universal", ADDRESS),), access=access))
    await runtime.start()
    yield runtime, token
    await runtime.close()


async def dial(runtime: Runtime) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Connect to the gateway as a client that trusts any certificate."""
    assert runtime._gateway is not None
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return await asyncio.open_connection("127.0.0.1", runtime._gateway.port, ssl=context)


async def next_kind(reader: asyncio.StreamReader) -> FrameKind:
    """Read a frame; return its kind."""
    number, _, size = HEAD.unpack(await reader.readexactly(HEAD.size))
    await reader.readexactly(size)
    return FrameKind(number)
