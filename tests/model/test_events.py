"""The event stream: typed, bounded, in order."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.input_device import InputDevice
from roboglot.model.events import BumperPressed, BumperReleased, Event, EventStream
from roboglot.model.inputs.external import ExternalInputs
from roboglot.model.tap import Tap


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


def test_nested_events_come_after_the_outer_one() -> None:
    """A listener's own event was seen before the one that it answers by all who listened after it."""
    events, early, late = EventStream(), list[float](), list[float]()
    events.listen(Event, lambda event: early.append(event.stamp))
    answers = {1.0: [2.0, 3.0], 2.0: [4.0], 3.0: []}

    def answer(event: Event) -> None:
        for stamp in answers.get(event.stamp, []):
            events.publish(BumperReleased(stamp=stamp, zone="front"))

    events.listen(Event, answer)
    events.listen(Event, lambda event: late.append(event.stamp))
    with events.subscribe(Event) as queued:
        events.publish(BumperPressed(stamp=1.0, zone="front"))
        assert early == late == [event.stamp for event in queued.drain()] == [1.0, 2.0, 3.0, 4.0]


def test_any_number_of_events_is_nested() -> None:
    events, heard = EventStream(), list[float]()

    def answer(event: Event) -> None:
        for stamp in range(2000) if isinstance(event, BumperPressed) else ():
            events.publish(BumperReleased(stamp=stamp, zone="front"))

    events.listen(Event, answer)
    events.listen(BumperReleased, lambda event: heard.append(event.stamp))
    events.publish(BumperPressed(stamp=1.0, zone="front"))
    assert heard == list(range(2000))


def test_broken_listener_keeps_no_event_from_others(caplog: pytest.LogCaptureFixture) -> None:
    events, early, late = EventStream(), list[float](), list[float]()

    def break_at(event: Event) -> None:
        if event.stamp == 1.0:
            events.publish(BumperReleased(stamp=2.0, zone="front"))
        if event.stamp <= 3.0:
            raise ValueError("no such bumper")

    events.listen(Event, lambda event: early.append(event.stamp))
    events.listen(Event, break_at)
    events.listen(Event, lambda event: late.append(event.stamp))
    with events.subscribe(Event) as queued:
        for stamp in (1.0, 3.0, 4.0):
            events.publish(BumperPressed(stamp=stamp, zone="front"))
        assert early == late == [event.stamp for event in queued.drain()] == [1.0, 2.0, 3.0, 4.0]
    lines = [record.getMessage().rpartition("<locals>.")[2] for record in caplog.records if record.exc_info]
    assert lines == [f"break_at failed at {kind}: no such bumper" for kind in ("BumperPressed", "BumperReleased")]


async def test_broken_listeners_harm_no_other() -> None:
    clock, heard = LockstepClock(), list[object]()

    def fail(_: object) -> None:
        raise ValueError

    tap, inputs, device = Tap("robot", clock), ExternalInputs("robot", clock), InputDevice()
    for listen in (tap.listen, inputs.listen, device.listen):
        listen(fail)
        listen(heard.append)
    tap.request("door", "operation", "")
    inputs.note("kind", "name", {})
    device.press("w")
    assert [type(news).__name__ for news in heard] == ["Exchange", "Input", "Input"]
    assert device.state.keys == ("w",)
