"""Chapter 6.2.3: hibernation and switching off (3.0)."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

from roboglot.model.actions import Action
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.operations import Right
from roboglot.protocols.vda5050.context import SOURCE, Context
from roboglot.protocols.vda5050.table import TABLE

SLEEP_MAX = 31 * 24 * 3600.0  # s


@TABLE.on("startHibernation", right=Right.ADMIN)
async def start_hibernation(context: Context, *, wakeUpTime: str = "") -> str:  # noqa: N803 - the standard's word
    """Drop the order, save power, and send no state until the robot is awake: ``wakeUpTime`` is ISO 8601, UTC.

    A robot without low power sleeps. Where neither is possible, the order goes on.
    """
    seconds = _seconds_until(wakeUpTime, context.robot.clock.epoch()) if wakeUpTime else None
    rest = _rest_of(context.robot[Power]) if Power in context.robot else None
    if not context.book.idle:
        await context.clear_order()
    if rest is not None:
        await context.performer.carry_out(rest(source=SOURCE))
    context.hibernation.begin(None if seconds is None else context.run_beside(_wake_in(context, seconds)))
    return ""


@TABLE.on("stopHibernation", right=Right.ADMIN)
async def stop_hibernation(context: Context) -> str:
    """Leave hibernation and accept orders again."""
    if Power in context.robot:
        await context.performer.carry_out(context.robot[Power].wake(source=SOURCE))
    context.hibernation.end()
    return ""


@TABLE.on("shutdown", right=Right.ADMIN, needs=(Power,))
async def shut_down(context: Context) -> str:
    """Switch the robot off after disconnecting from the broker; it reconnects when switched on."""
    if not context.book.idle:
        raise Refused(f"order {context.book.order_id} is not finished")
    await context.performer.carry_out(context.robot[Power].shut_down(source=SOURCE))
    context.leaving = True
    return ""


def _rest_of(power: Power) -> Callable[..., Action]:
    """Return what brings the robot to rest. Raises Refused where nothing does."""
    if not power.rests:
        raise Refused("this robot saves power only by itself")
    mode = power.mode if power.mode in power.rests else power.rests[0]
    if power.mode not in (mode, PowerMode.AWAKE):
        raise Refused(f"the robot is {power.mode}")
    return power.save if mode is PowerMode.LOW_POWER else power.sleep


async def _wake_in(context: Context, seconds: float) -> None:
    """Wake the robot after so many seconds; one that cannot be woken, its battery being empty, sleeps on."""
    await context.robot.clock.sleep(seconds)
    if Power in context.robot:
        context.robot[Power].wake(source=SOURCE)  # hibernation ends when it is awake
    else:
        context.hibernation.end()


def _seconds_until(text: str, now: float) -> float:
    """Return the seconds until a time. Raises InvalidGoal."""
    try:
        then = datetime.fromisoformat(text)
    except ValueError:
        raise InvalidGoal(f"{text[:40]!r} is not an ISO 8601 time") from None
    seconds = (then if then.tzinfo else then.replace(tzinfo=UTC)).timestamp() - now
    if not 0 < seconds <= SLEEP_MAX:
        raise InvalidGoal(f"{text[:40]} is not within the next 31 days")
    return seconds
