"""Pushes of a recorded dog reach its app in order, also what came just before it; heartbeats say what they said."""

from __future__ import annotations

import asyncio
from typing import cast

from roboglot.model.clock import LockstepClock
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.recorded_pushes import PlayedPushes
from roboglot.recording.playback import Playback
from roboglot.wire.cyberdog.chapters.system import AGAIN, HEARTBEAT, Beats, ticks_of
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb


class App:
    """An app that is slow to take the first message."""

    def __init__(self) -> None:
        self.connected = False
        self.on_found: list[object] = []
        self.heard: list[tuple[int, str]] = []
        self.free = asyncio.Event()

    async def send(self, code: int, text: str) -> None:
        await self.free.wait()
        self.heard.append((code, text))

    def come(self) -> None:
        self.connected = True
        for listener in self.on_found:
            assert callable(listener)
            listener()


async def settle() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


async def test_simultaneous_pushes_keep_their_order() -> None:
    clock, app = LockstepClock(), App()
    played = PlayedPushes(Playback([], clock, 0.0), cast(AppLink, app), clock, "cyberdog")
    played.put("2001", b"too old")
    await clock.advance(31.0)
    for number in range(3):
        played.put("2001", b"%d" % number)
    for none in ("no code", "²", "٣" * 4, "9" * 5000, str(2**31), "-1", ""):
        played.put(none, b"x")
    await settle()
    assert app.heard == []
    app.come()
    played.put("6005", b"pose")
    played.put("2001", b"3")
    await settle()
    app.free.set()
    await settle()
    assert [text for code, text in app.heard if code == 2001] == ["0", "1", "2", "3"]
    assert (6005, "pose") in app.heard
    assert played.ticks("1.2.3.4") is None
    played.put(HEARTBEAT, b'{"battery_power": 77, "ip": "9.9.9.9"}')
    ticks = played.ticks("1.2.3.4")
    assert ticks is not None
    assert (ticks.battery_power, ticks.ip) == (77, "1.2.3.4")
    played.close()


def test_heartbeats_with_news_are_noted() -> None:
    beats, noted = Beats(), 0
    for battery in (90, 89):
        ticks = pb.Ticks(ip="1.2.3.4", battery_power=battery, motion_status=pb.MotionStatus(motion_id=303))
        for number in range(2 * AGAIN):
            if news := beats.news(ticks):
                noted += 1
                assert ticks_of(news, "1.2.3.4") == ticks
            assert bool(news) == (number % AGAIN == 0)
    assert noted == 4
    assert ticks_of("[1]", "") is None
    assert ticks_of('{"battery_power": "x"}', "") is None
