"""The reference cloud as an ASGI application: how long it waits for a frame."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import pytest

from roboglot.protocols.visual import back_end
from roboglot.protocols.visual.back_end import BackEnd
from roboglot.storage.cloud import CloudStore
from roboglot.storage.database import Database
from roboglot.wire.visual.cloud import CloudCode, parse_answer


async def test_a_frame_that_never_ends_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(back_end, "BODY_SECONDS_MAX", 0.02)
    database = Database(":memory:")
    store = CloudStore(database)
    token = await store.add_account("school")
    pieces = iter([{"type": "http.request", "body": b"{", "more_body": True}])
    sent: list[Mapping[str, Any]] = []

    async def receive() -> Mapping[str, Any]:
        if (piece := next(pieces, None)) is None:
            await asyncio.Event().wait()
        return piece or {}

    async def send(event: Mapping[str, Any]) -> None:
        sent.append(event)

    headers = [(b"authorization", f"Bearer {token}".encode())]
    scope = {"type": "http", "path": "/programs", "method": "POST", "headers": headers}
    await asyncio.wait_for(BackEnd(store)(scope, receive, send), 10)
    assert sent[0]["status"] == 400
    assert parse_answer(sent[1]["body"]).code is CloudCode.TIMED_OUT
    database.close()
