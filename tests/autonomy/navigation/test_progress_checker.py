"""ProgressChecker of a drive: new plans alone are no progress, and ways are not tried for ever."""

from __future__ import annotations

import asyncio
import contextlib
import math
from types import SimpleNamespace
from typing import Any

import pytest

from roboglot.autonomy.navigation.drive_progress import DriveProgress
from roboglot.autonomy.navigation.pilot_tuning import PilotTuning
from roboglot.autonomy.navigation.progress_checker import ProgressChecker
from roboglot.autonomy.navigation.replanner import Replanner
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.navigation import Tracks
from roboglot.model.errors import Blocked, NotLocalized
from roboglot.model.geometry import Point, Pose


def made(clock: LockstepClock, **belief: Any) -> ProgressChecker:
    believed: Any = SimpleNamespace(
        **{"localizing": True, "lost": None, "quality": 1.0, "sigma": 0.003, "compared_at": -math.inf, **belief}
    )
    return ProgressChecker(clock, believed, PilotTuning(), 30.0)


async def test_another_way_alone_is_no_progress() -> None:
    clock = LockstepClock()
    checker = made(clock)
    follower: Any = SimpleNamespace(left=5.0, speed=0.0)
    assert checker.look(follower)
    for _ in range(31):
        await clock.advance(1.0)
        checker.take(5.0)
        assert not checker.look(follower)
    assert checker.spent


async def test_getting_closer_is_progress() -> None:
    clock = LockstepClock()
    checker = made(clock)
    follower: Any = SimpleNamespace(left=5.0, speed=0.0)
    for _ in range(40):
        await clock.advance(1.0)
        follower.left -= 0.11
        assert checker.look(follower)
    assert not checker.spent


async def test_wheels_that_turn_in_vain_are_reported() -> None:
    clock = LockstepClock()
    checker = made(clock)
    follower: Any = SimpleNamespace(left=5.0, speed=0.3)
    checker.look(follower)
    await clock.advance(3.5)
    with pytest.raises(Blocked):
        checker.look(follower)


async def test_lost_robot_gives_up() -> None:
    clock = LockstepClock()
    checker = made(clock, quality=0.1)
    checker.check_place()
    await clock.advance(5.5)
    with pytest.raises(NotLocalized):
        checker.check_place()


def replanning(tuning: PilotTuning, *, leaves: float | None = None, turning: float = 0.0) -> tuple[Replanner, Any]:
    """Return a replanner before an obstacle, and its follower. ``leaves``: s until a robot leaves the route."""
    context: Any = SimpleNamespace(
        robot=SimpleNamespace(clock=LockstepClock(), events=SimpleNamespace(listen=lambda *_: lambda: None)),
        tuning=tuning,
        belief=SimpleNamespace(pose=Pose()),
        traffic=SimpleNamespace(
            is_blocked_by_others=lambda *_, **__: leaves is not None, seconds_until_clear=lambda _: leaves
        ),
    )
    path_monitor: Any = SimpleNamespace(
        blocked=True,
        blocked_at=0.0 if leaves is not None else -100.0,
        blocked_place=Point(),
    )
    follower: Any = SimpleNamespace(
        left=5.0,
        passed=0,
        along=0.0,
        stop_at=0.0,
        take=lambda _: None,
        turning=lambda *_: turning,
        carrot=lambda: (Point(), 0.0),
        route=SimpleNamespace(ahead=lambda *_: None),
    )
    goal: Any = SimpleNamespace(points=(Point(),))
    planner: Any = None
    return Replanner(context, planner, goal, DriveProgress(), path_monitor), follower


def planned(length: float) -> Any:
    return SimpleNamespace(result=lambda: SimpleNamespace(length=length, goals=(Point(),)))


async def test_going_around_is_bounded() -> None:
    replanner, follower = replanning(PilotTuning(arounds_max=3))
    for _ in range(3):
        replanner._path_monitor.blocked = True
        assert replanner._take(follower, planned(6.0))
    replanner._path_monitor.blocked = True
    with pytest.raises(Blocked, match="3 times"):
        replanner._take(follower, planned(6.0))


async def go_around(replanner: Replanner, follower: Any, seconds: float) -> None:
    """Take eight ways that are blocked one after the other."""
    for _ in range(8):
        replanner._path_monitor.blocked = True
        assert replanner._take(follower, planned(6.0))
        await replanner._clock.sleep(seconds)


async def advancing(clock: Any, work: Any) -> None:
    task = asyncio.ensure_future(work)
    while not task.done():
        await clock.advance(0.5)
    await task


async def test_goal_blocked_on_all_sides_is_given_up() -> None:
    replanner, follower = replanning(PilotTuning())
    with pytest.raises(Blocked, match="on the goal: 6 ways"):
        await advancing(replanner._clock, go_around(replanner, follower, 6.0))


@pytest.mark.parametrize(("place", "seconds", "leaves"), [(2.0, 6.0, None), (0.0, 1.0, None), (0.0, 6.0, math.inf)])
async def test_others_and_the_way_do_not_count(place: float, seconds: float, leaves: float | None) -> None:
    """Obstacles far from the goal, for a moment only, or robots."""
    replanner, follower = replanning(PilotTuning(), leaves=leaves)
    replanner._path_monitor.blocked_place = Point(place)
    await advancing(replanner._clock, go_around(replanner, follower, seconds))


@pytest.mark.parametrize(
    ("leaves", "turning", "taken"), [(1.0, 0.0, True), (1.0, 2.0, False), (4.0, 2.0, True), (math.inf, 2.0, True)]
)
async def test_turning_back_for_one_that_leaves_takes_longer(leaves: float, turning: float, *, taken: bool) -> None:
    """A way around another robot, 0.4 m longer."""
    replanner, follower = replanning(PilotTuning(), leaves=leaves, turning=turning)
    assert replanner._take(follower, planned(length=follower.left + 0.4)) == taken


def test_strict_tracks_make_patient() -> None:
    tuning = PilotTuning()
    assert tuning.patience_for(Tracks.STRICT) == tuning.patience_on_tracks
    assert tuning.patience_for(Tracks.FREE) == tuning.patience


async def test_nothing_succeeds_while_place_is_uncertain() -> None:
    clock = LockstepClock()
    checker = made(clock, is_certain=False)
    believed: Any = checker._belief
    waiting = asyncio.ensure_future(checker.be_certain(0.05))
    await clock.advance(10.0)
    assert not waiting.done()
    believed.is_certain = True
    await clock.advance(0.2)
    assert waiting.done()
    believed.is_certain = False
    waiting = asyncio.ensure_future(checker.be_certain(0.05))
    await clock.advance(PilotTuning().found_seconds + 1.0)
    with pytest.raises(NotLocalized, match="do not confirm the place"):
        await waiting


@pytest.mark.parametrize(("sigma", "tolerance", "arrives"), [(0.4, 0.05, True), (0.6, 0.05, False), (0.6, 1.0, True)])
async def test_nothing_succeeds_at_an_open_place(sigma: float, tolerance: float, arrives: bool) -> None:
    clock = LockstepClock()
    waiting = asyncio.ensure_future(made(clock, is_certain=True, sigma=sigma).be_certain(tolerance))
    await clock.advance(1.0)
    with contextlib.nullcontext() if arrives else pytest.raises(NotLocalized, match=r"it may be 0\.6 m off"):
        await waiting
