"""Python's ``time`` on the robot's clock: sleeping and reading the time."""

from __future__ import annotations

from roboglot.programs.functions.session import Session, usable_seconds
from roboglot.programs.functions.table import TIME


@TIME.on("time.sleep")
async def sleep(session: Session, secs: float) -> None:
    """Wait; time spent suspended does not count."""
    await session.sleep(usable_seconds(secs))


@TIME.on("time.time")
async def epoch(session: Session) -> float:
    """Seconds since 1970."""
    return session.robot.clock.epoch()


@TIME.on("time.monotonic")
async def monotonic(session: Session) -> float:
    """Seconds since the robot's clock started."""
    return session.robot.clock.time()
