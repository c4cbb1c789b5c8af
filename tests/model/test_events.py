"""The event stream: typed, bounded, in order."""

from __future__ import annotations

import asyncio

from roboglot.model.events import BumperPressed, BumperReleased, Event, EventStream


async def test_a_reader_gets_its_types_in_order() -> None:
    events = EventStream()
    with events.subscribe(BumperPressed) as pressed, events.subscribe(Event) as everything:
        events.publish(BumperPressed(stamp=1, zone="front"))
        events.publish(BumperReleased(stamp=2, zone="front"))
        assert [e.stamp for e in pressed.drain()] == [1]
        assert [e.stamp for e in everything.drain()] == [1, 2]
    events.publish(BumperPressed(stamp=3, zone="rear"))
    assert pressed.drain() == []


async def test_slow_reader_loses_oldest_and_no_one_waits() -> None:
    events = EventStream()
    with events.subscribe(BumperPressed, maxlen=3) as slow:
        for stamp in range(10):
            events.publish(BumperPressed(stamp=stamp, zone="front"))
        assert slow.dropped == 7
        assert [e.stamp for e in slow.drain()] == [7, 8, 9]


async def test_next_waits() -> None:
    events = EventStream()
    with events.subscribe(BumperPressed) as reader:
        waiting = asyncio.ensure_future(reader.next())
        await asyncio.sleep(0)
        assert not waiting.done()
        events.publish(BumperPressed(stamp=5, zone="front"))
        assert (await waiting).stamp == 5


def test_a_listener_hears_until_it_leaves() -> None:
    async def run() -> list[float]:
        events, heard = EventStream(), []
        leave = events.listen(BumperPressed, lambda event: heard.append(event.stamp))
        events.publish(BumperPressed(stamp=1, zone="front"))
        leave()
        leave()
        events.publish(BumperPressed(stamp=2, zone="front"))
        return heard

    assert asyncio.run(run()) == [1]
