"""Live feeds: work only while someone looks, slow viewers, joining."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.model.errors import Busy, Refused
from roboglot.model.feed import VIEWERS_MAX, Feed


class Source:
    """A feed whose items can be joined at multiples of ten, and what happened to it."""

    def __init__(self) -> None:
        self.log: list[str] = []
        self.feed: Feed[int] = Feed(
            lambda: self.log.append("begin"),
            lambda: self.log.append("end"),
            queue_max=5,
            joinable=lambda n: n % 10 == 0,
        )


async def test_begins_with_first_viewer_and_ends_with_last():
    source = Source()
    one, other = source.feed.subscribe(), source.feed.subscribe()
    one.close()
    one.close()
    assert source.log == ["begin"]
    other.close()
    assert source.log == ["begin", "end"]
    with source.feed.subscribe():
        assert source.feed.viewers == 1
    assert source.log == ["begin", "end"] * 2


async def test_a_viewer_joins_where_it_can():
    source = Source()
    viewer = source.feed.subscribe()
    for number in (8, 9, 10, 11):
        source.feed.push(number)
    assert viewer.drain() == [10, 11]
    assert viewer.dropped == 2


async def test_slow_viewer_resumes_at_the_next_joint():
    source = Source()
    slow, quick = source.feed.subscribe(), source.feed.subscribe()
    got = []
    for number in range(10, 33):
        source.feed.push(number)
        got += quick.drain()
    assert got == list(range(10, 33))
    assert slow.drain() == [30, 31, 32]
    assert slow.dropped == 20


async def test_iterating_waits_and_ends_with_the_feed():
    source = Source()
    viewer = source.feed.subscribe()
    task = asyncio.ensure_future(anext(viewer))
    await asyncio.sleep(0)
    source.feed.push(10)
    assert await task == 10
    source.feed.push(11)
    source.feed.close()
    assert [number async for number in viewer] == [11]


async def test_unread_while_no_viewer_has_read_the_newest() -> None:
    feed: Feed[int] = Feed(lambda: None, lambda: None, queue_max=2)
    quick, slow = feed.subscribe(), feed.subscribe()
    assert not feed.unread
    feed.push(1)
    assert feed.unread
    assert await anext(quick) == 1
    assert not feed.unread  # one of them waits for more
    assert slow.waiting == 1


async def test_viewers_are_limited():
    source = Source()
    for _ in range(VIEWERS_MAX):
        source.feed.subscribe()
    with pytest.raises(Busy):
        source.feed.subscribe()


def test_failed_begin_is_tried_again() -> None:
    begun = iter([Refused("no link"), None])

    def begin() -> None:
        if (error := next(begun)) is not None:
            raise error

    feed: Feed[int] = Feed(begin, lambda: None, queue_max=1)
    with pytest.raises(Refused):
        feed.subscribe()
    with feed.subscribe() as viewer:
        feed.push(1)
        assert viewer.drain() == [1]
    assert next(begun, "none left") == "none left"
