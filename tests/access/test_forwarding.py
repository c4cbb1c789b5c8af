"""Clients on other machines that come through a reverse proxy on this one, and so from loopback."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import httpx
import pytest
import websockets
from hypothesis import given
from hypothesis import strategies as st

from roboglot.access.store import Grant, open_store
from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, is_loopback, load_config
from roboglot.operations import Right
from roboglot.protocols.forwarding import UNNAMED, caller, elsewhere_of
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses, free_port
from tests.narrowing import known

ADDRESS = free_addresses(1)
ELSEWHERE = "203.0.113.7"
ADDRESSES = st.one_of(st.ip_addresses(v=4), st.ip_addresses(v=6)).map(str).filter(lambda text: not is_loopback(text))


@pytest.mark.parametrize(
    ("values", "elsewhere"),
    [
        ([], ""),
        (["127.0.0.1"], ""),
        (["::1", "::ffff:127.0.0.1"], ""),
        ([ELSEWHERE], ELSEWHERE),
        (["1.2.3.4, 203.0.113.7"], ELSEWHERE),
        (["203.0.113.7, 127.0.0.1"], ELSEWHERE),
        (["203.0.113.7", "127.0.0.1"], ELSEWHERE),
        (["203.0.113.7:4711"], ELSEWHERE),
        (["[2001:db8::1]:4711"], "2001:db8::1"),
        (["2001:db8::1"], "2001:db8::1"),
        (['for=192.0.2.43;proto=https, for="203.0.113.7:80";by=127.0.0.1'], ELSEWHERE),
        (['For="[2001:db8::1]:4711"'], "2001:db8::1"),
        (["for=_hidden"], UNNAMED),
        (["unknown"], UNNAMED),
        (["x.localhost"], UNNAMED),
    ],
)
def test_last_other_machine_counts(values: list[str], elsewhere: str) -> None:
    assert elsewhere_of(values) == elsewhere


@given(st.lists(st.text(max_size=40), max_size=5), ADDRESSES)
def test_clients_own_headers_hide_nothing(invented: list[str], client: str) -> None:
    """A proxy adds the client's address behind whatever it was sent, to the same header or in one more."""
    assert elsewhere_of([*invented, client]) == elsewhere_of([", ".join([*invented, client])]) == client


@given(st.lists(st.binary(max_size=60), max_size=5))
def test_any_header_is_read(values: list[bytes]) -> None:
    rows = [(b"x-forwarded-for", value) for value in values]
    assert caller("127.0.0.1:4711", rows).endswith("127.0.0.1:4711")
    assert caller("10.0.0.7:4711", rows) == "10.0.0.7:4711"


@asynccontextmanager
async def opened(folder: Path, *, on: bool, insecure: bool = False) -> AsyncIterator[Runtime]:
    """A robot with its doors and a console; ``on``: with access control, in which local programs may do everything."""
    base = load_config(None, {"data": str(folder), "world": "empty", "lockstep": True})
    robots, console = (RobotConfig("a", "universal", ADDRESS),), ConsoleConfig(port=free_port())
    runtime = Runtime(replace(base, robots=robots, console=console, access=AccessConfig(on=on), insecure=insecure))
    await runtime.start()
    try:
        yield runtime
    finally:
        await runtime.close()


async def _status(url: str, headers: dict[str, str]) -> int:
    async with httpx.AsyncClient(timeout=60) as client:
        return (await client.get(url, headers=headers)).status_code


async def _opened(url: str, headers: dict[str, str]) -> int:
    """Return the status with which a WebSocket opens or is refused."""
    try:
        async with websockets.connect(url, additional_headers=headers, open_timeout=60):
            return 200
    except websockets.InvalidStatus as refused:
        return refused.response.status_code


async def answers(runtime: Runtime, **headers: str) -> list[int]:
    """Return the answers of REST, of block programs, and of the console to a client with these headers."""
    console = known(runtime.console)
    await console.ready()
    sent = {name.replace("_", "-"): value for name, value in headers.items()}
    return list(
        await asyncio.gather(
            _status(f"http://{ADDRESS}:1448/api/core/system/v1/power/status", sent),
            _opened(f"ws://{ADDRESS}:50053/programs", sent),
            _status(f"{console.address}/api/me", sent),
        )
    )


async def test_other_machines_are_refused_without_access_control(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Behind a proxy on this machine, anyone who reached it could drive the robot."""
    async with opened(tmp_path, on=False) as runtime:
        assert await answers(runtime) == [200, 200, 200]
        assert await answers(runtime, x_forwarded_for="127.0.0.1") == [200, 200, 200]  # a page's development server
        assert await answers(runtime, x_forwarded_for=ELSEWHERE) == [403, 403, 403]
        assert await answers(runtime, forwarded=f"for={ELSEWHERE}") == [403, 403, 403]
    assert f"a proxy passes it on for {ELSEWHERE}, and only programs of this machine may use it: let" in caplog.text


async def test_other_machines_are_admitted_if_all_are(tmp_path: Path) -> None:
    async with opened(tmp_path, on=False, insecure=True) as runtime:
        assert await answers(runtime, x_forwarded_for=ELSEWHERE) == [200, 200, 200]


async def test_other_machines_need_a_name_behind_a_proxy(tmp_path: Path) -> None:
    """Local programs need none; a proxy is one of them, but not those for whom it asks."""
    store = open_store(tmp_path)
    token = store.add_machine("cell", [Grant("a", frozenset({Right.DRIVE}))])
    store.allow(ELSEWHERE, [Grant("a", frozenset({Right.DRIVE}))])  # by address: any program here could claim it
    store.close()
    async with opened(tmp_path, on=True) as runtime:
        assert await answers(runtime) == [200, 200, 200]
        assert await answers(runtime, x_real_ip=ELSEWHERE) == [401, 401, 401]
        named = {"x_forwarded_for": ELSEWHERE, "authorization": f"Bearer {token}"}
        assert await answers(runtime, **named) == [200, 200, 200]


@pytest.mark.parametrize(
    ("headers", "secure"),
    [
        ({}, False),
        ({"x-forwarded-for": ELSEWHERE, "x-forwarded-proto": "http"}, False),
        ({"x-forwarded-for": ELSEWHERE, "x-forwarded-proto": "https"}, True),
        ({"x-forwarded-proto": "https, http"}, False),
        ({"forwarded": f'for={ELSEWHERE};Proto="https"'}, True),
    ],
)
async def test_session_keeps_to_tls_behind_a_proxy(tmp_path: Path, headers: dict[str, str], secure: bool) -> None:
    """The browser must not send the session's cookie over HTTP later."""
    store = open_store(tmp_path)
    token = store.add_machine("cell", [Grant("a", frozenset({Right.DRIVE}))])
    store.close()
    async with opened(tmp_path, on=True) as runtime, httpx.AsyncClient(timeout=60) as client:
        console = known(runtime.console)
        await console.ready()
        reply = await client.post(f"{console.address}/api/sign_in", json={"token": token}, headers=headers)
        assert reply.status_code == 200
        assert ("secure" in reply.headers["set-cookie"].lower().split("; ")) is secure
