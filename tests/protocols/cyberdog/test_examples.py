"""The documentation's examples, one a code, are true: both languages have the same, and each is answered as it says."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.protocols.cyberdog.table import pushes
from roboglot.wire.contracts import contract
from tests.drivers.settling import settle
from tests.protocols.cyberdog.phone import Client, examples

FILES = {4004}  # for getFile; the page has its own example


def test_both_pages_have_an_example_of_every_code() -> None:
    english, chinese = examples("cyberdog.md"), examples("cyberdog.zh.md")
    assert english == chinese
    asked = {code for code, _, _ in english}
    assert {int(row.key) for row in contract("cyberdog")} <= asked | FILES | {int(code) for code in pushes}


@pytest.mark.world("office", body="cyberdog2")
async def test_every_example_is_answered_as_it_says(client: Client, robot, forward) -> None:
    async def pass_time() -> None:
        while True:
            await forward(seconds=0.05)
            await settle()

    passing = asyncio.ensure_future(pass_time())
    try:
        for code, params, said in examples("cyberdog.md"):
            async with asyncio.timeout(60):
                answers = [answer.data async for answer in client.open(code, params)]
            assert answers, code
            first, _, last = said.partition(" … ")
            begins = first.rstrip("…")
            assert answers[0].startswith(begins) if "…" in first else answers[0] == begins, f"{code}: {answers}"
            assert not last or answers[-1] == last, f"{code}: {answers}"
    finally:
        passing.cancel()
