"""A robot in lockstep with its console open, and a client of the console's interface."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from ipaddress import IPv4Address
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest_asyncio

from roboglot.config import ConsoleConfig, RobotConfig, load_config
from roboglot.console.desk import Desk
from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(2)
OTHER_ADDRESS = str(IPv4Address(ADDRESS) + 1)


@dataclass(frozen=True, slots=True)
class ServedConsole:
    """A robot, its clock, and where its console is."""

    runtime: Runtime
    robot: Robot
    clock: LockstepClock
    url: str

    @property
    def desk(self) -> Desk:
        """The console's."""
        assert self.runtime.console is not None
        return self.runtime.console._desk

    async def ask(self, path: str, values: object = None, **headers: str) -> tuple[int, Any]:
        """GET ``path``, or POST ``values`` to it; the status and the answer."""
        body = None if values is None else json.dumps(values).encode()
        return await asyncio.to_thread(_fetch, Request(self.url + path, data=body, headers=headers))

    async def read(self, path: str) -> bytes:
        """GET ``path``, which answers with a file."""
        return await asyncio.to_thread(_read, self.url + path)


def _read(url: str) -> bytes:
    with urlopen(url, timeout=60) as reply:
        data: bytes = reply.read()
    return data


def _fetch(request: Request) -> tuple[int, Any]:
    try:
        with urlopen(request, timeout=60) as reply:
            status, text = reply.status, reply.read().decode()
    except HTTPError as error:
        with error:
            status, text = error.code, error.read().decode()
    return status, json.loads(text) if text.startswith(("{", "[")) else text


@pytest_asyncio.fixture
async def served(tmp_path: Path) -> AsyncIterator[ServedConsole]:
    """A runtime as ``roboglot up --world empty --lockstep`` starts it; the console takes any port."""
    base = load_config(None, {"data": str(tmp_path), "world": "empty", "lockstep": True})
    config = replace(base, robots=(RobotConfig("a", "universal", ADDRESS),), console=ConsoleConfig(port=0))
    runtime = Runtime(config)
    assert isinstance(runtime.clock, LockstepClock)
    assert runtime.console is not None
    await runtime.start()
    await runtime.console.ready()
    yield ServedConsole(runtime, runtime.fleet.robots["a"], runtime.clock, runtime.console.address)
    await runtime.close()
