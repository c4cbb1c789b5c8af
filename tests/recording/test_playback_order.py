"""Order and times of a played recording's answers."""

from __future__ import annotations

import asyncio
import heapq
from collections.abc import Coroutine, Sequence

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
    return [
        (reply.payload, reply.status) async for reply in playback.answer("robomaster", operation, text, reads=reads)
    ]


async def test_answers_and_pushes_keep_times_and_clients_ids() -> None:
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


async def test_sequence_numbers_replace_no_other_numbers() -> None:
    """Recorded 4, live 99: a position of 4.5 m became 99.5 m, in answers and in pushes."""
    rest = ("a", "robomaster", "127.0.0.1:5", "x")
    session = [
        Exchange(1.0, *rest, Direction.REQUEST, "chassis position", b"chassis position ? seq 4"),
        Exchange(1.0, *rest, Direction.REPLY, "chassis position", b"4.500 4 0.000 seq 4 ;", "ok", "", 0.0),
        Exchange(1.0, *rest, Direction.PUSH, "> chassis push", b"chassis push position 4.500 4 0.000;"),
    ]
    clock, pushed = LockstepClock(), list[bytes]()
    playback = Playback(session, clock, 0.0)
    playback.join("robomaster", lambda _, message: pushed.append(message))
    asking = asyncio.create_task(ask(playback, b"chassis position ? seq 99", reads=True))
    await clock.advance(1.0)
    assert asking.result() == [(b"4.500 4 0.000 seq 99 ;", "ok")]
    assert pushed == [b"chassis push position 4.500 4 0.000;"]


@pytest.mark.parametrize(
    ("recorded", "answered", "live", "expected"),
    [
        (b"chassis speed ?", b"0.100 0.000;", b"chassis speed ? seq 7;", b"0.100 0.000 seq 7 ;"),
        (b"chassis speed ? seq 3", b"0.100 seq 3 ;", b"chassis speed ?;", b"0.100;"),
        (b"chassis speed ? seq 3", b"0.100 seq 3 ", b"chassis speed ?", b"0.100 "),
        (b"chassis move x 1", b"ok", b"chassis move x 1 seq 7", b"ok seq 7"),
    ],
)
async def test_commands_match_with_and_without_sequence_numbers(
    recorded: bytes, answered: bytes, live: bytes, expected: bytes
) -> None:
    rest = ("a", "robomaster", "127.0.0.1:5", "x")
    operation = b" ".join(recorded.split()[:2]).decode()
    session = [
        Exchange(1.0, *rest, Direction.REQUEST, operation, recorded),
        Exchange(1.0, *rest, Direction.REPLY, operation, answered, "ok", "", 0.0),
    ]
    clock = LockstepClock()
    asking = asyncio.create_task(ask(Playback(session, clock, 0.0), live, reads=b"?" in live))
    await clock.advance(1.0)
    assert asking.result() == [(expected, "ok")]


async def test_queries_with_sequence_numbers_repeat() -> None:
    """They counted as commands, each answered once and in order."""
    rest = ("a", "robomaster", "127.0.0.1:5", "x")
    session = [
        exchange
        for n, speed in ((1, b"0.1;"), (2, b"0.2;"))
        for exchange in (
            Exchange(float(n), *rest, Direction.REQUEST, "chassis speed", b"chassis speed ? seq %d" % n),
            Exchange(float(n), *rest, Direction.REPLY, "chassis speed", speed, "ok", "", 0.0),
            Exchange(n + 0.5, *rest, Direction.REQUEST, "chassis move", b"chassis move x %d" % n),
            Exchange(n + 0.5, *rest, Direction.REPLY, "chassis move", b"ok;", "ok", "", 0.0),
        )
    ]
    clock = LockstepClock()
    playback, seen = Playback(session, clock, 0.0), list[bytes]()
    for line in (b"chassis speed ? seq 5", b"chassis speed ? seq 6", b"chassis move x 1", b"chassis speed ? seq 7"):
        asking = asyncio.create_task(ask(playback, line, reads=b"?" in line))
        await clock.advance(2.0)
        seen += [payload for payload, _ in asking.result()]
    assert seen == [b"0.1;", b"0.1;", b"ok;", b"0.2;"]


async def test_unrecorded_requests_are_refused_and_noted(caplog: pytest.LogCaptureFixture) -> None:
    playback = Playback(pushing_session(), LockstepClock(), 0.0)
    with pytest.raises(NotFound, match="no such request"):
        await ask(playback, b"chassis fly z 3")
    with pytest.raises(NotFound):
        await ask(playback, b"chassis move x 9")
    assert playback.missing == [("robomaster", "chassis fly"), ("robomaster", "chassis move")]
    assert caplog.messages == [f"robomaster: not in the recording: chassis {rest}" for rest in ("fly z 3", "move x 9")]


TIMES = st.lists(st.floats(0.01, 5.0), min_size=1, max_size=12)


@given(TIMES, st.data())
async def test_session_played_back_in_order_is_the_session(times: list[float], data: st.DataObject) -> None:
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


class BusyClock(LockstepClock):
    """Finds all that has become due at once, as a busy machine does: no task runs between two timers."""

    async def advance(self, seconds: float) -> None:
        await super().advance(0.0)
        self._now += seconds
        while self._heap and self._heap[0][0] <= self._now:
            if callback := heapq.heappop(self._heap)[2].callback:
                callback()
        await super().advance(0.0)


REQUESTS = {
    "slamware": ("PUT /api/core/motion/v1/actions", b"POST /api/core/motion/v1/actions\n\n{}"),
    "robomaster": ("chassis move", b"chassis move x 1"),
    "cyberdog": ("6004", b"{}"),
    "visual": ("task run", b'{"type":"task","operate":"run","id":"7","target_id":["t"]}'),
}


async def played(door: str, directions: Sequence[Direction], gaps: Sequence[float], busy: Sequence[float]) -> list[str]:
    """Return the output in order: the request is asked once, then time passes in the steps of ``busy``."""
    rest, (operation, payload) = ("a", door, "127.0.0.1:5"), REQUESTS[door]
    exchanges, now = [Exchange(0.0, *rest, "x", Direction.REQUEST, operation, payload)], 0.0
    for index, (direction, gap) in enumerate(zip(directions, gaps, strict=True)):
        now += gap
        seconds = now if direction is Direction.REPLY else 0.0
        exchanges.append(Exchange(now, *rest, "x", direction, operation, b"<%d>" % index, "ok", "", seconds))
    clock, sent = BusyClock(), list[str]()
    playback = Playback(exchanges, clock, 0.0)
    playback.join(door, lambda _, message: sent.append(message.decode()))

    async def serve() -> None:
        async for reply in playback.answer(door, operation, payload, reads=False):
            sent.append(reply.payload.decode())

    serving = asyncio.create_task(serve())
    for seconds in (*busy, 100.0):
        await clock.advance(seconds)
    await serving
    return sent


@pytest.mark.parametrize("door", REQUESTS)
async def test_busy_machine_leaves_answers_before_pushes_that_followed(door: str) -> None:
    order = (Direction.PUSH, Direction.REPLY, Direction.PUSH)
    assert await played(door, order, (0.1, 0.1, 0.1), ()) == ["<0>", "<1>", "<2>"]
    assert await played(door, order, (0.0, 0.0, 0.0), ()) == ["<0>", "<1>", "<2>"]


@given(
    st.lists(st.tuples(st.sampled_from((Direction.PUSH, Direction.REPLY)), st.floats(0.0, 0.5)), max_size=20),
    st.lists(st.floats(0.0, 1.0), max_size=10),
)
async def test_messages_after_commands_keep_their_recorded_order(
    items: list[tuple[Direction, float]], busy: list[float]
) -> None:
    directions, gaps = [direction for direction, _ in items], [gap for _, gap in items]
    assert await played("cyberdog", directions, gaps, busy) == [f"<{index}>" for index in range(len(items))]


async def test_answer_waits_for_a_push_recorded_just_before() -> None:
    rest = ("a", "visual", "front ends", "x")
    asked = b'{"type":"task","operate":"inquiry","id":"%d","target_id":[]}'
    exchanges = [
        Exchange(0.0, *rest, Direction.REQUEST, *REQUESTS["visual"]),
        Exchange(0.0, *rest, Direction.REPLY, "task run", b"started", "ok"),
        Exchange(1.0, *rest, Direction.PUSH, "", b"stopped"),
        Exchange(1.2, *rest, Direction.PUSH, "", b"state"),
        Exchange(1.3, *rest, Direction.REQUEST, "task inquiry", asked % 1),
        Exchange(1.3, *rest, Direction.REPLY, "task inquiry", b"list", "ok"),
    ]
    clock, sent = LockstepClock(), list[str]()
    playback = Playback(exchanges, clock, 0.0)
    playback.join("visual", lambda _, message: sent.append(message.decode()))

    async def ask(operation: str, payload: bytes, *, reads: bool) -> None:
        async for reply in playback.answer("visual", operation, payload, reads=reads):
            sent.append(reply.payload.decode())

    await ask_while(clock, ask(*REQUESTS["visual"], reads=False), 1.0)
    await ask_while(clock, ask("task inquiry", asked % 2, reads=True), 0.3)
    assert sent == ["started", "stopped", "state", "list"]
    await ask_while(clock, ask("task inquiry", asked % 3, reads=True), 0.0)  # the second time: at once
    assert sent[4:] == ["list"]


async def ask_while(clock: LockstepClock, asking: Coroutine[object, object, None], seconds: float) -> None:
    task = asyncio.create_task(asking)
    await clock.advance(seconds)
    await task
