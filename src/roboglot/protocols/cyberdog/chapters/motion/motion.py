"""Chapter "motion": servo commands (1002), their responses (1003), motions with a result (1004)."""

from __future__ import annotations

import logging

from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import STILL
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.motion.gait import Executed
from roboglot.protocols.cyberdog.chapters.motion.motion_start import MotionRequest
from roboglot.protocols.cyberdog.chapters.motion.motion_table import POSES, SERVO_POSES, WALKS
from roboglot.protocols.cyberdog.chapters.motion.reasons import reason, servo_reason
from roboglot.protocols.cyberdog.profile import Profile
from roboglot.protocols.cyberdog.table import TABLE, push
from roboglot.protocols.cyberdog.vocabulary import ALL_FEET, body_of, feet_of, lift_of, twist_of
from roboglot.transport.log_limiter import LogLimiter
from roboglot.wire.cyberdog.chapters.motion.motion import CommandType, Motion, MotionCode
from roboglot.wire.cyberdog.codes import Code, InBandError
from roboglot.wire.cyberdog.text import Int32, Three, TwoOrThree

limited_log = LogLimiter(logging.getLogger(__name__))
SERVO_RESPONSE = push(Code.SERVO_RESPONSE, depth=2)
CALIBRATION = 4  # ``value`` of a frame
ANSWER_MAX = 20.0  # s after which the answer is a time-out, whether or not the motion continues


@TABLE.on(Code.SERVO, right=Right.DRIVE, needs=(Driving,))
async def servo(
    call: Call,
    *,
    motion_id: Int32,
    cmd_type: Int32 = CommandType.DATA,
    vel_des: Three = [],  # noqa: B006 - never changed
    pos_des: Three = [],  # noqa: B006
    rpy_des: Three = [],  # noqa: B006
    step_height: TwoOrThree = [],  # noqa: B006
    value: Int32 = 0,
    cmd_id: Int32 | None = None,
) -> str:
    """Execute one joystick frame: ``vel_des`` [x m/s, y m/s, yaw rad/s], kept for 200 ms. Answered by push 1003.

    ``value``: 0 feet toed in, 2 straight below the hips, 4 calibration: lie down and release the motors.
    """
    gaits = call.context.gaits
    if cmd_type == CommandType.END:
        executed = gaits.end_servo()
    elif cmd_type not in (CommandType.START, CommandType.DATA):
        executed = Executed(MotionCode.PARAMETERS)
    elif value == CALIBRATION:
        executed = gaits.calibrate()
    elif motion_id in WALKS:
        request = MotionRequest(
            twist_of(motion_id, vel_des), body_of(pos_des, rpy_des), lift=lift_of(step_height, value)
        )
        executed = gaits.servo(motion_id, request)
    elif motion_id in SERVO_POSES:
        executed = gaits.servo(motion_id, MotionRequest(body=body_of(pos_des, rpy_des)))
    else:
        executed = Executed(MotionCode.UNSUPPORTED)
    if executed.code is not MotionCode.DONE:
        why = servo_reason(executed.code, motion_id, cmd_type)
        limited_log.warning(f"{motion_id} {why}", "%d refused: %s", call.code, why)
    response: dict[str, object] = {
        "motion_id": motion_id,
        "result": executed.code is MotionCode.DONE,
        "code": int(executed.code),
        "status": int(executed.status),
        "order_process_bar": round(100 * executed.share),
    }
    call.context.app.push(SERVO_RESPONSE, response if cmd_id is None else {**response, "cmd_id": cmd_id})
    return ""


@TABLE.on(Code.MOTION, right=Right.DRIVE)
async def motion(
    call: Call,
    *,
    motion_id: Int32,
    vel_des: Three = [],  # noqa: B006 - never changed
    pos_des: Three = [],  # noqa: B006
    rpy_des: Three = [],  # noqa: B006
    step_height: TwoOrThree = [],  # noqa: B006
    contact: Int32 = ALL_FEET,
    duration: Int32 = 0,
) -> dict[str, object]:
    """Perform a motion that ends by itself; ``duration`` in ms (walks, poses). Answered at its end, within 20 s."""
    walks, poses = motion_id in WALKS or motion_id == Motion.USER_GAIT, motion_id in POSES
    request = MotionRequest(
        twist_of(motion_id, vel_des) if walks else STILL,
        body_of(pos_des if poses else [], rpy_des if poses else []),
        duration / 1000.0,
        lift_of(step_height),
        feet_of(contact),
    )
    try:
        code = await call.context.robot.clock.wait_for(call.context.gaits.carry_out(motion_id, request), ANSWER_MAX)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    if code is not MotionCode.DONE:
        call.why = reason(code, motion_id, request)
    reported = call.context.gaits.motion if call.context.profile is Profile.ROBOT else motion_id
    return {"motion_id": int(reported), "result": code is MotionCode.DONE, "code": int(code)}
