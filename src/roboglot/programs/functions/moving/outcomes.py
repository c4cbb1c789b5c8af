"""Outcomes of motions, in the manual's two types of results and with its error codes (4.2, 4.4.04)."""

from __future__ import annotations

from collections.abc import Coroutine

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.health import MOTOR_ALARM, Health
from roboglot.model.errors import Busy, ComponentMissing, EmergencyStopped, Expired, InvalidGoal, Refused, RobotError
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.worker.values import Record

PROTECTED_UP_TO = 0.20  # charge at or below which the robot protects its legs
TOO_EMPTY, MOTOR_FAULTY, STOPPED = 3026, 3032, 3040
WHEN_STOPPED = frozenset({0, 111})  # stopping and standing up: what a robot does after an emergency stop
ALWAYS = frozenset({0, 101, 111})  # no state of the robot forbids stopping, lying down or standing up

_CODES: tuple[tuple[type[RobotError], int], ...] = (
    (ComponentMissing, 3008),
    (InvalidGoal, 3010),
    (Busy, 3011),
    (EmergencyStopped, STOPPED),
    (Refused, 3003),
    (Expired, 3028),
    (RobotError, 3029),
)


async def result(session: Session, motion: int, doing: Coroutine[object, object, None], wrong: str = "") -> Record:
    """Execute ``doing`` unless a parameter is ``wrong``; return the outcome as MotionResultServiceResponse."""
    outcome, response = await report_outcome(session, motion, wrong, doing)
    return Record("MotionResultServiceResponse", {"state": outcome, "response": Record("MotionResult", response)})


async def servo(session: Session, motion: int, doing: Coroutine[object, object, None], wrong: str = "") -> Record:
    """Execute ``doing`` unless a parameter is ``wrong``; return the outcome as MotionServoCmdResponse."""
    outcome, response = await report_outcome(session, motion, wrong, doing)
    response["order_process_bar"] = 100 if response["result"] else 0
    return Record("MotionServoCmdResponse", {"state": outcome, "response": Record("MotionServoCmd", response)})


async def report_outcome(
    session: Session, motion: int, wrong: str, doing: Coroutine[object, object, None]
) -> tuple[Record, dict[str, object]]:
    """Execute ``doing`` unless a parameter is ``wrong``; return the State and the common fields of all results."""
    code = 0
    try:
        if not wrong:
            code, wrong = _unfit(session, motion)
        if wrong:
            raise Refused(wrong) if code else InvalidGoal(wrong)
        await doing
    except RobotError as error:
        doing.close()
        return state(StateCode.FAIL, str(error)), {
            "motion_id": motion,
            "result": False,
            "code": code or code_of(session, error),
        }
    return state(), {"motion_id": motion, "result": True, "code": 0}


def _unfit(session: Session, motion: int) -> tuple[int, str]:
    """Return code and text of the robot's condition that forbids ``motion``; 0 without one."""
    robot = session.robot
    if motion not in WHEN_STOPPED and Legs in robot and robot[Legs].posture is Posture.LIMP:
        return STOPPED, "the robot is limp after an emergency stop: it has to stand up first"
    if motion in ALWAYS:
        return 0, ""
    if Battery in robot and robot[Battery].state.percentage <= PROTECTED_UP_TO:
        return TOO_EMPTY, "the battery is too low for this"
    if Health in robot and robot[Health].has(MOTOR_ALARM):
        return MOTOR_FAULTY, "a motor does not turn"
    return 0, ""


def code_of(session: Session, error: RobotError) -> int:
    """Return the manual's code of an error."""
    robot = session.robot
    if type(error) is Refused and Battery in robot and robot[Battery].state.percentage <= PROTECTED_UP_TO:
        return TOO_EMPTY
    return next(code for kind, code in _CODES if isinstance(error, kind))
