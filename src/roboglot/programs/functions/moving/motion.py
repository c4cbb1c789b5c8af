"""cyberdog.motion: limits, standing, lying, stopping (4.4.04).

A call returns when the robot has finished. A refusal by the limits or the robot moves nothing and is reported in
``state`` and ``response.code``; the program continues.
"""

from __future__ import annotations

from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.legs import Legs
from roboglot.programs.functions.moving.limits import LIMITS
from roboglot.programs.functions.moving.outcomes import result
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

# MotionId: the firmware's number of each motion, response.motion_id.
EMERGENCY_STOP, GET_DOWN, STAND = 0, 101, 111


@ABILITIES.on("cyberdog.motion.params")
async def params(_session: Session) -> Record:
    """Limits of table 4.1 as MotionParams (attribute)."""
    return Record(
        "MotionParams",
        {
            name: Record(
                "DefaultAndMaximum",
                {
                    "minimum_value": row.minimum,
                    "default_value": row.default,
                    "maximum_value": row.maximum,
                    "unit": row.unit,
                },
            )
            for name, row in LIMITS.items()
        },
    )


@ABILITIES.on("cyberdog.motion.emergency_stop")
async def emergency_stop(session: Session) -> Record:
    """Stop at once and go limp; only standing up ends that. A robot without legs brakes."""

    async def do() -> None:
        if Legs in session.robot:
            session.robot[Legs].go_limp()
        else:
            await session.robot.actions.cancel(resource=BASE, reason="emergency stop")

    return await result(session, EMERGENCY_STOP, do())


@ABILITIES.on("cyberdog.motion.get_down", needs=(Legs,))
async def get_down(session: Session) -> Record:
    """Lie down."""

    async def do() -> None:
        await session.complete(session.robot[Legs].lie_down(source=session.source))

    return await result(session, GET_DOWN, do())


@ABILITIES.on("cyberdog.motion.resume_standing", needs=(Legs,))
async def resume_standing(session: Session) -> Record:
    """Stand up."""

    async def do() -> None:
        await session.complete(session.robot[Legs].stand(source=session.source))

    return await result(session, STAND, do())
