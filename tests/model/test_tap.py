"""The tap: everything to those who follow, and nothing at all while no one does."""

from __future__ import annotations

from roboglot.model.client_context import set_client
from roboglot.model.clock import LockstepClock
from roboglot.model.tap import PAYLOAD_MAX, QUEUE_MAX, Direction, Exchange, Tap


async def test_a_request_and_its_reply_belong_together(clock: LockstepClock) -> None:
    tap = Tap("a", clock)
    with tap.subscribe() as viewer:
        set_client("slamware 10.0.0.7", "10.0.0.7:5000")
        began = tap.request("slamware", "GET /x", b"GET /x\n\n")
        await clock.advance(0.25)
        tap.reply("slamware", "GET /x", "no", "403", "not now", began)
        asked, answered = viewer.drain()
    common = ("a", "slamware", "10.0.0.7:5000", "slamware 10.0.0.7")
    assert asked == Exchange(0.0, *common, Direction.REQUEST, "GET /x", b"GET /x\n\n", turn=0)
    assert answered == Exchange(0.25, *common, Direction.REPLY, "GET /x", b"no", "403", "not now", 0.25)


def test_it_is_watched_while_someone_follows(clock: LockstepClock) -> None:
    tap, heard = Tap("a", clock), list[Exchange]()
    assert not tap.watched
    leave = tap.listen(heard.append)
    viewer = tap.subscribe()
    leave()
    leave()
    assert tap.watched
    tap.push("robomaster", "10.0.0.7:40924", "> chassis push", b"x")
    assert (len(viewer.drain()), heard) == (1, [])
    viewer.close()
    assert not tap.watched


def test_slow_viewer_counts_its_lost_exchanges(clock: LockstepClock) -> None:
    tap, heard = Tap("a", clock), list[Exchange]()
    tap.listen(heard.append)
    with tap.subscribe() as viewer:
        for _ in range(QUEUE_MAX + 10):
            tap.push("robomaster", "", "", b"x")
        assert (viewer.dropped, len(viewer.drain())) == (QUEUE_MAX, 10)
    assert len(heard) == QUEUE_MAX + 10


def test_payloads_are_bounded(clock: LockstepClock) -> None:
    tap = Tap("a", clock)
    with tap.subscribe() as viewer:
        tap.push("slamware", "", "", bytes(PAYLOAD_MAX + 1))
        tap.push("visual", "", "", "狗\ud800")
        long, odd = viewer.drain()
    assert (len(long.payload), odd.payload) == (PAYLOAD_MAX, "狗?".encode())
