"""In which order and at which times a recorded session answers."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.clock import LockstepClock
from roboglot.model.errors import NotFound
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.playback import Playback


def pushing_session() -> list[Exchange]:
    rest = ("a", "robomaster", "127.0.0.1:5", "x")
    return [
        Exchange(1.0, *rest, Direction.REQUEST, "chassis push", b"chassis push position on"),
        Exchange(1.1, *rest, Direction.REPLY, "chassis push", b"ok;", "ok", "", 0.1),
        Exchange(1.5, *rest, Direction.PUSH, "> chassis push", b"chassis push position 1 0 0;"),
        Exchange(2.0, *rest, Direction.REQUEST, "chassis move", b"chassis move x 1 seq 4"),
        Exchange(4.0, *rest, Direction.REPLY, "chassis move", b"ok seq 4;", "ok", "", 2.0),
        Exchange(5.0, *rest, Direction.PUSH, "> chassis push", b"chassis push position 2 0 0;"),
    ]


async def ask(playback: Playback, text: bytes, *, reads: bool = False) -> list[tuple[bytes, str]]:
    operation = b" ".join(text.split()[:2]).decode()
    return [tuple(reply) async for reply in playback.answer("robomaster", operation, text, reads=reads)]


async def test_answers_and_pushes_come_at_their_times_with_the_clients_own_ids() -> None:
    clock = LockstepClock()
    playback, pushed = Playback(pushing_session(), clock, 0.0), list[tuple[float, bytes]]()
    playback.join("robomaster", lambda _, message: pushed.append((round(clock.time(), 3), message)))
    await clock.advance(100.0)
    asking = asyncio.create_task(ask(playback, b"chassis push position on"))
    await clock.advance(0.05)
    assert not asking.done()
    await clock.advance(0.05)
    assert asking.result() == [(b"ok;", "ok")]
    await clock.advance(1.0)
    assert pushed == [(100.5, b"chassis push position 1 0 0;")]
    moving = asyncio.create_task(ask(playback, b"chassis move x 1 seq 99"))
    await clock.advance(1.9)
    assert not moving.done()
    await clock.advance(2.0)
    assert moving.result() == [(b"ok seq 99;", "ok")]
    assert pushed[1:] == [(104.1, b"chassis push position 2 0 0;")]


async def test_what_was_never_recorded_is_refused_and_noted() -> None:
    playback = Playback(pushing_session(), LockstepClock(), 0.0)
    with pytest.raises(NotFound, match="no such request"):
        await ask(playback, b"chassis fly z 3")
    with pytest.raises(NotFound):
        await ask(playback, b"chassis move x 9")
    assert playback.missing == [("robomaster", "chassis fly"), ("robomaster", "chassis move")]


TIMES = st.lists(st.floats(0.01, 5.0), min_size=1, max_size=12)


@given(TIMES, st.data())
async def test_a_session_played_back_in_order_is_the_session(times: list[float], data: st.DataObject) -> None:
    exchanges, now = list[Exchange](), 0.0
    rest = ("a", "robomaster", "127.0.0.1:5", "x")
    texts: list[bytes] = []
    for index, after in enumerate(times):
        text = data.draw(st.sampled_from((b"chassis position ?", b"chassis move x 1", b"led control comp all r 1")))
        key = b" ".join(text.split()[:2]).decode()
        exchanges.append(Exchange(now, *rest, Direction.REQUEST, key, text))
        exchanges.append(Exchange(now + after, *rest, Direction.REPLY, key, b"%d;" % index, "ok", "", after))
        texts.append(text)
        now += after + 0.5
    clock = LockstepClock()
    playback, answers = Playback(exchanges, clock, 0.0), list[bytes]()
    for text in texts:
        asking = asyncio.create_task(ask(playback, text, reads=text.endswith(b"?")))
        await clock.advance(6.0)
        answers += [payload for payload, _ in asking.result()]
    assert answers == [b"%d;" % index for index in range(len(texts))]
