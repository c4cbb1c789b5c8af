"""Patience of a drive: new plans alone are no progress, and ways are not tried for ever."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from roboglot.autonomy.navigation.journey import Journey
from roboglot.autonomy.navigation.patience import Patience
from roboglot.autonomy.navigation.pilot_tuning import PilotTuning
from roboglot.autonomy.navigation.replanner import Replanner
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.navigation import Tracks
from roboglot.model.errors import Blocked, NotLocalized


def made(clock: LockstepClock, **belief: Any) -> Patience:
    believed: Any = SimpleNamespace(**{"localizing": True, "lost": None, "quality": 1.0, **belief})
    return Patience(clock, believed, PilotTuning(), 30.0)


async def test_another_way_alone_is_no_progress() -> None:
    clock = LockstepClock()
    patience = made(clock)
    follower: Any = SimpleNamespace(left=5.0, speed=0.0)
    assert patience.look(follower)
    for _ in range(31):
        await clock.advance(1.0)
        patience.take(5.0)
        assert not patience.look(follower)
    assert patience.spent


async def test_getting_closer_is_progress() -> None:
    clock = LockstepClock()
    patience = made(clock)
    follower: Any = SimpleNamespace(left=5.0, speed=0.0)
    for _ in range(40):
        await clock.advance(1.0)
        follower.left -= 0.11
        assert patience.look(follower)
    assert not patience.spent


async def test_wheels_that_turn_in_vain_are_reported() -> None:
    clock = LockstepClock()
    patience = made(clock)
    follower: Any = SimpleNamespace(left=5.0, speed=0.3)
    patience.look(follower)
    await clock.advance(3.5)
    with pytest.raises(Blocked):
        patience.look(follower)


async def test_lost_robot_gives_up() -> None:
    clock = LockstepClock()
    patience = made(clock, quality=0.1)
    patience.check_place()
    await clock.advance(5.5)
    with pytest.raises(NotLocalized):
        patience.check_place()


async def test_going_around_is_bounded() -> None:
    events = SimpleNamespace(listen=lambda *_: lambda: None)
    course: Any = SimpleNamespace(
        robot=SimpleNamespace(clock=LockstepClock(), events=events), tuning=PilotTuning(arounds_max=3), belief=None
    )
    goal: Any = SimpleNamespace(points=(None,))
    lookout: Any = SimpleNamespace(blocked=True, blocked_at=-100.0)
    options: Any = None
    replanner = Replanner(course, options, goal, Journey(), lookout)
    follower: Any = SimpleNamespace(left=5.0, passed=0, along=0.0, take=lambda _: None, stop_at=0.0)
    plan: Any = SimpleNamespace(result=lambda: SimpleNamespace(length=6.0, goals=(None,)))
    for _ in range(3):
        lookout.blocked = True
        assert replanner._take(follower, plan)
    lookout.blocked = True
    with pytest.raises(Blocked, match="3 times"):
        replanner._take(follower, plan)


def test_strict_tracks_make_patient() -> None:
    tuning = PilotTuning()
    assert tuning.patience_for(Tracks.STRICT) == tuning.patience_on_tracks
    assert tuning.patience_for(Tracks.FREE) == tuning.patience


async def test_nothing_succeeds_while_place_is_uncertain() -> None:
    clock = LockstepClock()
    patience = made(clock, is_certain=False)
    believed: Any = patience._belief
    waiting = asyncio.ensure_future(patience.be_certain())
    await clock.advance(10.0)
    assert not waiting.done()
    believed.is_certain = True
    await clock.advance(0.2)
    assert waiting.done()
    believed.is_certain = False
    waiting = asyncio.ensure_future(patience.be_certain())
    await clock.advance(PilotTuning().found_seconds + 1.0)
    with pytest.raises(NotLocalized, match="do not confirm the place"):
        await waiting
