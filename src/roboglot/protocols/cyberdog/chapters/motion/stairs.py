"""Chapter "stairs": alignment with a flight (1100, 1101), two services that the manual omits."""

from __future__ import annotations

from roboglot.model.actions import Action
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.stair_alignment import (
    ALIGN_WITH_STAIRS,
    AlignmentStage,
    StairAlignment,
    StairDirection,
)
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.chapters.motion.readiness import refusal_of
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.chapters.motion.motion import Motion
from roboglot.wire.cyberdog.codes import Code, InBandError

ANSWER_MAX = 5.0  # s, getting up included
LOOK = 0.05  # s between two checks of the progress
BEGUN = (AlignmentStage.ALIGNING, AlignmentStage.ALIGNED)


@TABLE.on(Code.ALIGN_WITH_STAIRS, right=Right.DRIVE, needs=(StairAlignment,))
async def align_with_stairs(call: Call, *, data: bool) -> dict[str, object]:
    """Align with a flight that leads up (``data`` true) or down (false). Answered once it moves.

    ``success`` is false where no step is seen, and while the robot's state or another motion prevents walking.
    """
    robot, gaits = call.context.robot, call.context.gaits
    alignment = robot[StairAlignment]
    if gaits.busy or refusal_of(robot, Motion.TROT_SLOW) is not None:
        return call.refused({"success": False}, "the robot cannot walk now")
    try:
        action = alignment.align(StairDirection.UP if data else StairDirection.DOWN, source=SOURCE)
    except RobotError as error:
        return call.refused({"success": False}, str(error))
    try:
        await robot.clock.wait_for(_begun(robot, action), ANSWER_MAX)
    except TimeoutError:
        action.cancel("its start could not be reported")
        return {"error_code": int(InBandError.TIMEOUT)}
    if action.feedback not in BEGUN:
        return call.refused({"success": False}, action.reason or "no step is seen")
    return {"success": True}


@TABLE.on(Code.END_STAIR_ALIGNMENT, right=Right.DRIVE, needs=(StairAlignment,))
async def end_stair_alignment(call: Call) -> dict[str, bool]:
    """Stop the alignment of any client, if there is one. Answered once the robot stands."""
    call.context.robot.require(StairAlignment)
    for action in call_off(call.context.robot, "stopped by the app"):
        await action.done()
    return {"success": True}


def call_off(robot: Robot, reason: str, source: str | None = None) -> list[Action]:
    """Cancel the alignment under way if ``source`` started it or is empty; return what was cancelled."""
    running = [action for action in robot.actions.running(BASE) if action.name == ALIGN_WITH_STAIRS]
    doomed = [action for action in running if source is None or action.source == source]
    for action in doomed:
        action.cancel(reason)
    return doomed


async def _begun(robot: Robot, action: Action) -> None:
    async for _ in robot.clock.every(LOOK):
        if action.feedback in BEGUN or action.status.ended:
            return
