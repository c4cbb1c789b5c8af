"""A recording of a played-back recording is the recording: record(replay(x)) = x."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.model.clock import LockstepClock
from roboglot.model.tap import Direction, Exchange, Tap
from roboglot.recording.comparing.comparison import compare
from roboglot.recording.playback import Playback
from roboglot.recording.reader import pair

READS = {
    "slamware": b"GET /api/core/slam/v1/localization/pose\n\n",
    "robomaster": b"chassis position ?",
    "cyberdog": b"{}",
    "visual": b'{"type":"task","operate":"inquiry","id":"%d","target_id":[]}',
}
CHANGES = {
    "slamware": b'POST /api/core/motion/v1/actions\n\n{"n":"%s"}',
    "robomaster": b"chassis move x %s",
    "cyberdog": b'{"n":"%s"}',
    "visual": b'{"type":"task","operate":"run","id":"7","target_id":["%s"]}',
}
KEYS = {
    "slamware": ("GET pose", "POST actions"),
    "robomaster": ("chassis position", "chassis move"),
    "cyberdog": ("10001", "6004"),
    "visual": ("task inquiry", "task run"),
}
# For each request: its kind, the delay of its answers, of the pushes, of the next request (ms).
STEPS = st.tuples(
    st.sampled_from("abcr"), st.integers(0, 400), st.lists(st.integers(0, 900), max_size=3), st.integers(0, 1500)
)


def session(door: str, steps: list[tuple[str, int, list[int], int]]) -> list[Exchange]:
    """Return a possible session: answers before the next request, pushes at any time."""
    found: list[tuple[int, int, Exchange]] = []
    now = serial = 0
    rest = ("a", door, "front ends", "x")
    for name, answered, pushes, pause in steps:
        reads = name == "r"
        text = READS[door] if reads else CHANGES[door] % name.encode()
        key = KEYS[door][not reads]
        serial += 1
        found.append((now, serial, Exchange(now / 1000, *rest, Direction.REQUEST, key, text)))
        serial += 1
        then = now + answered
        reply = Exchange(then / 1000, *rest, Direction.REPLY, key, b"<%d>" % serial, "ok", "", answered / 1000)
        found.append((then, serial, reply))
        for after in () if reads else pushes:
            serial += 1
            moment = now + after
            found.append((moment, serial, Exchange(moment / 1000, *rest, Direction.PUSH, "push", b"[%d]" % serial)))
        now = max(then, now) + pause + 1
    return [exchange for *_, exchange in sorted(found, key=lambda one: one[:2])]


async def recorded_again(door: str, exchanges: list[Exchange]) -> list[Exchange]:
    """Play it back to a client that asks the same at the same times; what a tap notes of that."""
    clock = LockstepClock()
    playback, tap, noted = Playback(exchanges, clock, 0.0), Tap("a", clock), list[Exchange]()
    tap.listen(noted.append)
    playback.join(door, lambda operation, data: tap.push(door, "front ends", operation, data), [KEYS[door][0]])

    async def ask(request: Exchange) -> None:
        began = tap.request(door, request.operation, request.payload)
        reads = request.operation == KEYS[door][0]
        async for reply in playback.answer(door, request.operation, request.payload, reads=reads):
            tap.reply(door, request.operation, reply.payload, reply.status, began=began)

    asking = []
    for asked in pair(exchanges)[0]:
        await clock.advance_to(max(clock.time(), asked.request.stamp))
        asking.append(asyncio.create_task(ask(asked.request)))
        await clock.advance(0.0)
    await clock.advance(10.0)
    await asyncio.gather(*asking)
    return noted


def essence(exchanges: list[Exchange]) -> list[tuple[object, ...]]:
    return [(round(e.stamp, 6), e.direction, e.operation, e.payload, e.status, round(e.seconds, 6)) for e in exchanges]


@pytest.mark.parametrize("door", READS)
@settings(max_examples=40, deadline=None)
@given(steps=st.lists(STEPS, min_size=1, max_size=12))
async def test_recording_a_replay_gives_the_recording(door: str, steps: list[tuple[str, int, list[int], int]]) -> None:
    exchanges = session(door, steps)
    again = await recorded_again(door, exchanges)
    assert sorted(essence(again), key=repr) == sorted(essence(exchanges), key=repr)
    assert compare(exchanges, again).fidelity == 1.0
