"""cyberdog.motion: standing, lying, walking, turning (4.4.04).

A call returns when the robot has finished. What the limits forbid or the robot refuses moves nothing and is told in
``state`` and ``response.code``; the program goes on.
"""

from __future__ import annotations

import math
from collections.abc import Coroutine

from roboglot.model.components.base import Base
from roboglot.model.components.driving import BASE, Driving
from roboglot.model.components.legs import Legs
from roboglot.model.components.odometry import Odometry
from roboglot.model.errors import (
    Busy,
    ComponentMissing,
    EmergencyStopped,
    Expired,
    InvalidGoal,
    Refused,
    RobotError,
)
from roboglot.model.geometry import Pose, Twist
from roboglot.programs.functions.limits import LIMITS, outside
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

SINGLE_COMMAND = 0.2  # s that one command of a walk lasts when neither distance nor duration is given
LOOK_EVERY = 0.02  # s
STUCK_AFTER = 2.0  # s without a centimetre
ONE_GAIT = "every gait is the same one yet, and the height of the feet, though checked, changes nothing"

# MotionId: the firmware's number of each motion, told in response.motion_id.
EMERGENCY_STOP, GET_DOWN, STAND, VARIABLE = 0, 101, 111, 304
WALKS = {"trot_walking": 303, "automatic_frequency_conversion_walking": 304, "run_fast_walking": 305}

_CODES: tuple[tuple[type[RobotError], int], ...] = (
    (ComponentMissing, 3008),
    (InvalidGoal, 3010),
    (Busy, 3011),
    (EmergencyStopped, 3040),
    (Refused, 3003),
    (Expired, 3028),
    (RobotError, 3029),
)


@ABILITIES.on("cyberdog.motion.params")
async def params(session: Session) -> Record:
    """The limits of table 4.1 as MotionParams (attribute)."""
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
    """Stop at once and go limp; only standing up leads out. A robot without legs brakes."""

    async def do() -> None:
        if Legs in session.robot:
            session.robot[Legs].go_limp()
        else:
            await session.robot.actions.cancel(resource=BASE, reason="emergency stop")

    return await _result(EMERGENCY_STOP, do())


@ABILITIES.on("cyberdog.motion.get_down")
async def get_down(session: Session) -> Record:
    """Lie down."""

    async def do() -> None:
        await session.complete(session.robot[Legs].lie_down(source=session.source))

    return await _result(GET_DOWN, do())


@ABILITIES.on("cyberdog.motion.resume_standing")
async def resume_standing(session: Session) -> Record:
    """Stand up."""

    async def do() -> None:
        await session.complete(session.robot[Legs].stand(source=session.source))

    return await _result(STAND, do())


@ABILITIES.on("cyberdog.motion.turn")
async def turn(session: Session, angle: float = 0.0, duration: float = 1.0) -> Record:
    """Turn by ``angle`` degrees (left positive) within ``duration`` s, or as fast as table 4.1 allows if longer."""
    wrong = outside(angle=angle, duration=duration)
    top = LIMITS["z_velocity"].maximum
    rate = min(abs(angle) / duration, top) if duration > 0 else top

    async def do() -> None:
        if angle:
            yaw, speed = math.radians(angle), math.radians(rate)
            await session.complete(
                session.robot[Driving].move_by(Pose(yaw=yaw), yaw_speed=speed, source=session.source)
            )

    return await _servo(VARIABLE, wrong, do())


@ABILITIES.on("cyberdog.motion.go_straight")
async def go_straight(
    session: Session, x_velocity: float = 0.0, distance: float = 0.0, duration: float = 1.0
) -> Record:
    """Walk ahead (m/s, negative: back) for ``distance`` m, else for ``duration`` s."""
    wrong = outside(x_velocity=x_velocity, distance=distance, walk_duration=duration)
    return await _servo(VARIABLE, wrong, _walk(session, Twist(x_velocity), distance, duration))


@ABILITIES.on("cyberdog.motion.lateral_movement")
async def lateral_movement(
    session: Session, y_velocity: float = 0.0, distance: float = 0.0, duration: float = 1.0
) -> Record:
    """Walk to the left (m/s, negative: right) for ``distance`` m, else for ``duration`` s."""
    wrong = outside(y_velocity=y_velocity, distance=distance, walk_duration=duration)
    return await _servo(VARIABLE, wrong, _walk(session, Twist(y=y_velocity), distance, duration))


def _declare_walk(name: str, motion: int) -> None:
    @ABILITIES.on(f"cyberdog.motion.{name}", partial=ONE_GAIT)
    async def walk(
        session: Session,
        x_velocity: float = 0.0,
        y_velocity: float = 0.0,
        z_velocity: float = 0.0,
        front_leg_lift: float = 0.03,
        back_leg_lift: float = 0.03,
        distance: float = 0.0,
        duration: float = 1.0,
    ) -> Record:
        """Walk (m/s; z in degrees/s, left positive) for ``distance`` m, else for ``duration`` s."""
        wrong = outside(
            x_velocity=x_velocity,
            y_velocity=y_velocity,
            z_velocity=z_velocity,
            front_leg_lift=front_leg_lift,
            back_leg_lift=back_leg_lift,
            distance=distance,
            walk_duration=duration,
        )
        twist = Twist(x_velocity, y_velocity, math.radians(z_velocity))
        return await _servo(motion, wrong, _walk(session, twist, distance, duration))


for _name, _motion in WALKS.items():
    _declare_walk(_name, _motion)


async def _walk(session: Session, twist: Twist, distance: float, duration: float) -> None:
    """Walk for a distance (m, by odometry), else for a time (s), else for one command."""
    driving = session.robot[Driving]
    if distance > 0 and not twist.speed:
        raise InvalidGoal("a distance needs a velocity")
    if distance > 0 and not twist.yaw:
        way = distance / twist.speed
        move = driving.move_by(Pose(twist.x * way, twist.y * way), speed=twist.speed, source=session.source)
        await session.complete(move)
    elif distance > 0:
        await _walk_along(session, twist, distance)
    elif duration > 0:
        await session.hold(driving.drive(twist, source=session.source), duration)
    else:
        driving.drive(twist, lifetime=SINGLE_COMMAND, source=session.source)


async def _walk_along(session: Session, twist: Twist, distance: float) -> None:
    """Walk an arc of this length."""
    odometry = session.robot[Odometry]
    top = session.robot[Base].limits.twist
    action = session.robot[Driving].drive(twist, source=session.source)
    start = best = odometry.reading.distance
    waited = 0.0
    patience = STUCK_AFTER + 0.1 / min(twist.speed, top.x)
    try:
        while (gone := odometry.reading.distance) - start < distance:
            if action.status.ended:
                raise action.error or Busy(f"{action.name} was cancelled")
            best, waited = (gone, 0.0) if gone - best > 0.01 else (best, waited + LOOK_EVERY)
            if waited > patience:
                raise RobotError(f"stuck {distance - gone + start:.2f} m before the end")
            await session.sleep(LOOK_EVERY)
    finally:
        action.cancel()
    await action.done()


async def _result(motion: int, doing: Coroutine[object, object, None]) -> Record:
    """Do it and say how it went, as MotionResultServiceResponse."""
    outcome, response = await _outcome(motion, "", doing)
    return Record("MotionResultServiceResponse", {"state": outcome, "response": Record("MotionResult", response)})


async def _servo(motion: int, wrong: str, doing: Coroutine[object, object, None]) -> Record:
    """Do it unless a parameter is ``wrong`` and say how it went, as MotionServoCmdResponse."""
    outcome, response = await _outcome(motion, wrong, doing)
    response["order_process_bar"] = 100 if response["result"] else 0
    return Record("MotionServoCmdResponse", {"state": outcome, "response": Record("MotionServoCmd", response)})


async def _outcome(motion: int, wrong: str, doing: Coroutine[object, object, None]) -> tuple[Record, dict[str, object]]:
    try:
        if wrong:
            doing.close()
            raise InvalidGoal(wrong)
        await doing
    except RobotError as error:
        code = next(code for kind, code in _CODES if isinstance(error, kind))
        return state(StateCode.FAIL, str(error)), {"motion_id": motion, "result": False, "code": code}
    return state(), {"motion_id": motion, "result": True, "code": 0}
