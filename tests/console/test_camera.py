"""Live video of the console: who may see it, for how long."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from roboglot.console.camera import Calls


async def test_a_call_ends_when_its_caller_may_see_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.console.camera.REVOKED_SECONDS", 0.0)
    answers, closed = iter([True, True, False]), asyncio.Event()

    class Call:
        async def close(self) -> None:
            closed.set()

    robot: Any = SimpleNamespace(admission=SimpleNamespace(may=lambda _right: next(answers)))
    call: Any = Call()
    calls = Calls()
    calls._calls.add(call)
    calls._look_after(robot, call)
    assert not closed.is_set()
    async with asyncio.timeout(20):
        await closed.wait()
    assert not calls._calls
