"""Chapter 6.2.3: hibernation and switching off (3.0)."""

from __future__ import annotations

from datetime import UTC, datetime

from roboglot.model.components.energy.power import Power
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.operations import Right
from roboglot.protocols.vda5050.performing import ended
from roboglot.protocols.vda5050.session import SOURCE, Session
from roboglot.protocols.vda5050.table import TABLE

SLEEP_MAX = 31 * 24 * 3600.0  # s


@TABLE.on("startHibernation", right=Right.ADMIN)
async def start_hibernation(session: Session, *, wakeUpTime: str = "") -> str:  # noqa: N803 - the standard's word
    """Forget the order, save power, and send no state until stopHibernation or the wake-up time (ISO 8601, UTC)."""
    seconds = _seconds_until(wakeUpTime, session.robot.clock.epoch()) if wakeUpTime else None
    if not session.book.idle:
        await session.clear_order()
    if Power in session.robot:
        await ended(session.robot[Power].save(source=SOURCE))
    session.hibernating = True
    if seconds is not None:
        session.alarm = session.run_beside(_wake_in(session, seconds))
    return ""


@TABLE.on("stopHibernation", right=Right.ADMIN)
async def stop_hibernation(session: Session) -> str:
    """Be ready for orders again."""
    if session.alarm is not None:
        session.alarm.cancel()
    await _wake(session)
    return ""


@TABLE.on("shutdown", right=Right.ADMIN, needs=(Power,))
async def shut_down(session: Session) -> str:
    """Switch the robot off; it takes leave of the broker before, and comes back when it is switched on."""
    if not session.book.idle:
        raise Refused(f"order {session.book.order_id} is not finished")
    await ended(session.robot[Power].shut_down(source=SOURCE))
    session.leaving = True
    return ""


async def _wake_in(session: Session, seconds: float) -> None:
    await session.robot.clock.sleep(seconds)
    session.alarm = None
    await _wake(session)


async def _wake(session: Session) -> None:
    if Power in session.robot:
        await ended(session.robot[Power].wake(source=SOURCE))
    session.hibernating = False
    session.touch()


def _seconds_until(text: str, now: float) -> float:
    """Return how long it is until then. Raises InvalidGoal."""
    try:
        then = datetime.fromisoformat(text)
    except ValueError:
        raise InvalidGoal(f"{text[:40]!r} is no time of ISO 8601") from None
    seconds = (then if then.tzinfo else then.replace(tzinfo=UTC)).timestamp() - now
    if not 0 < seconds <= SLEEP_MAX:
        raise InvalidGoal(f"{text[:40]} is not within the next 31 days")
    return seconds
