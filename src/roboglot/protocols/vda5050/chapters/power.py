"""Chapter 6.2.3: hibernation and switching off (3.0)."""

from __future__ import annotations

from datetime import UTC, datetime

from roboglot.model.components.energy.power import Power
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.operations import Right
from roboglot.protocols.vda5050.context import SOURCE, Context
from roboglot.protocols.vda5050.table import TABLE

SLEEP_MAX = 31 * 24 * 3600.0  # s


@TABLE.on("startHibernation", right=Right.ADMIN)
async def start_hibernation(context: Context, *, wakeUpTime: str = "") -> str:  # noqa: N803 - the standard's word
    """Drop the order, save power, and send no state until the robot is awake: ``wakeUpTime`` is ISO 8601, UTC."""
    seconds = _seconds_until(wakeUpTime, context.robot.clock.epoch()) if wakeUpTime else None
    if not context.book.idle:
        await context.clear_order()
    if Power in context.robot:
        await context.performer.carry_out(context.robot[Power].save(source=SOURCE))
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
