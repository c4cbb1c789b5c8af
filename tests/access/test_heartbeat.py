"""Reactions of a tunnel's end to the other's silence, on counted beats: no clock, no socket, no waiting."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.access.tunnel.heartbeat import (
    HELD_UP,
    IDLE_PERIOD,
    LOST_AFTER,
    QUICK_PERIOD,
    QUIET_AFTER,
    QUIET_ALONE_AFTER,
    Heartbeat,
)
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.legs import Legs
from roboglot.model.geometry import Twist
from roboglot.storage.database import Database

STANDS_WITHIN = 0.5  # s after the line went dead
MARGIN = 0.03  # s of slack for a busy loop
LATE = 0.001  # s that a timer may be late


def looks(heart: Heartbeat, now: float, until: float, drives: bool = True) -> tuple[float | None, int]:
    """Look from ``now`` as a loop does. When the client was taken for gone, and the beats that were sent."""
    quiet, beats = None, 0
    while now < until:
        look = heart.look(now, drives)
        beats += look.beat
        if look.quiet:
            assert quiet is None, "said once"
            quiet = now
        now += look.pause + LATE
    return quiet, beats


@given(st.floats(0.0, 1.0), st.booleans())
def test_silence_is_noticed_at_its_time(last_heard: float, drives: bool) -> None:
    heart, now = Heartbeat(0.0), 0.0
    while now < last_heard:
        now += heart.look(now, drives).pause + LATE
        heart.note_life(now)
    quiet, _ = looks(heart, now, now + 1.0, drives)
    assert quiet is not None
    assert QUIET_AFTER <= quiet - heart.heard + 1e-9 <= QUIET_AFTER + 6 * LATE


def test_beats_come_often_only_while_someone_drives() -> None:
    assert looks(Heartbeat(0.0), 0.0, 1.0, drives=True)[1] >= 1 / (QUICK_PERIOD + 2 * LATE)
    assert looks(Heartbeat(0.0), 0.0, 1.0, drives=False)[1] <= 11
    asked = Heartbeat(0.0)
    asked.note_life(0.0, quick=True)
    assert looks(asked, 0.0, 0.4, drives=False)[1] >= 0.4 / (QUICK_PERIOD + 2 * LATE)


def test_delayed_end_reads_earlier_beats_before_judging() -> None:
    heart = Heartbeat(0.0)
    assert not heart.look(IDLE_PERIOD, drives=True).quiet
    woken = IDLE_PERIOD + HELD_UP + 0.5  # the whole machine was suspended, and the other end with it
    look = heart.look(woken, drives=True)
    assert not look.quiet
    for _ in range(5):  # several turns of the loop in a row decide nothing
        assert not heart.look(woken, drives=True).quiet
    assert not heart.look(woken + QUICK_PERIOD, drives=True).quiet  # now it may; the loop reads its sockets first
    heart.note_life(woken + QUICK_PERIOD)
    assert looks(heart, woken + QUICK_PERIOD, woken + 0.2)[0] is None


def test_only_long_silence_is_a_loss() -> None:
    heart = Heartbeat(0.0)
    assert looks(heart, 0.0, 1.0)[0] is not None
    heart.note_life(1.0)
    assert looks(heart, 1.0, 1.2)[0] is None
    heart.look(LOST_AFTER + 1.0, drives=True)
    assert heart.look(LOST_AFTER + 1.0, drives=True).lost


def test_beats_beside_tunnel_excuse_its_silence_for_while() -> None:
    heart, now, quiet = Heartbeat(0.0), 0.0, list[float]()
    while now < 1.5:
        now += QUICK_PERIOD
        heart.note_life_beside(now)
        if heart.look(now, drives=True).quiet:
            quiet.append(now)
    assert quiet
    assert QUIET_ALONE_AFTER <= quiet[0] < QUIET_ALONE_AFTER + 0.1


def test_beats_beside_do_not_keep_a_dead_tunnel() -> None:
    heart = Heartbeat(0.0)
    heart.note_life_beside(LOST_AFTER)
    assert heart.look(LOST_AFTER, drives=False).lost


@pytest.mark.parametrize(
    ("body", "speed"), [("universal", 0.6), ("robomaster_ep", 1.0), ("cyberdog2", 0.5), ("hermes", 0.4)]
)
async def test_silence_and_brakes_together_stay_below_half_second(body: str, speed: float) -> None:
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig("a", body)], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    robot, truth = fleet.robots["a"], fleet.world.truth

    async def shift() -> float:
        """Drive on for 20 ms; m/s that it really moves."""
        before = truth.pose_of("a")
        await clock.advance(0.02)
        return before.distance_to(truth.pose_of("a")) / 0.02

    action = robot[Driving].drive(Twist(x=speed), source="by hand")
    await clock.advance(3.0 if Legs in robot else 1.0)
    assert await shift() == pytest.approx(speed, abs=0.1 * speed)
    action.cancel("its client is out of reach", hard=True)
    spent = 0.02
    while await shift() > 0.02:
        spent += 0.02
    assert QUIET_AFTER + spent <= STANDS_WITHIN - MARGIN
    assert abs(robot[Base].velocity.x) < 0.02
    robot[Driving].drive(Twist(x=speed), source="by hand")
    await clock.advance(0.06)
    began = robot[Base].velocity.x
    await clock.advance(0.02)
    assert robot[Base].velocity.x - began <= 1.01 * 0.02 * robot[Base].limits.linear_acceleration, "as gently as ever"
    await fleet.close()
    database.close()
