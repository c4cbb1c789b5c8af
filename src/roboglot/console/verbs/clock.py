"""Verbs that steer the time of a simulated world: pause, go on, step, faster, slower."""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.model.clock import Clock, RealClock
from roboglot.model.errors import Refused
from roboglot.operations import OperationTable, Right

Pace = Annotated[float, msgspec.Meta(ge=0.05, le=50)]
Seconds = Annotated[float, msgspec.Meta(gt=0, le=60)]

CLOCK_VERBS: OperationTable[str] = OperationTable("console clock", Right.ADMIN, exact=True)


def steerable(clock: Clock) -> RealClock:
    """Return ``clock`` if a person may steer it. Raises Refused for a lockstep clock."""
    if not isinstance(clock, RealClock):
        raise Refused("this world runs in lockstep: the program that started it advances its clock")
    return clock


@CLOCK_VERBS.on("pause_clock")
async def pause_clock(clock: Clock) -> None:
    """Freeze the world and its robots; the doors go on answering."""
    steerable(clock).pause()


@CLOCK_VERBS.on("resume_clock")
async def resume_clock(clock: Clock) -> None:
    """Let time pass again."""
    steerable(clock).resume()


@CLOCK_VERBS.on("step_clock")
async def step_clock(clock: Clock, *, seconds: Seconds = 0.1) -> None:
    """Let so much robot time pass, then freeze."""
    steerable(clock).step(seconds)


@CLOCK_VERBS.on("set_clock_speed")
async def set_clock_speed(clock: Clock, *, speed: Pace) -> None:
    """Let robot time pass ``speed`` times as fast as real time, as far as the machine keeps up."""
    steerable(clock).set_speed(speed)
