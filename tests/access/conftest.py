"""A runtime in lockstep whose robot has access control."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from roboglot.access.store import AccessStore, Grant, open_store
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
