"""Chapter "motion": servo commands (1002), their responses (1003), motions with a result (1004)."""

from __future__ import annotations

from typing import Any

from roboglot.model.components.legs import Posture
from roboglot.model.geometry import STILL, Twist
from roboglot.protocols.cyberdog.gait import Executed, Gaits
from roboglot.protocols.cyberdog.table import Call, operations, push
from roboglot.protocols.cyberdog.vocabulary import twist_of
from roboglot.wire.cyberdog.codes import Code, InBandError
from roboglot.wire.cyberdog.motions import GAITS, CommandType, Motion, MotionCode, SwitchStatus
from roboglot.wire.cyberdog.text import Int32

SERVO_RESPONSE = push(Code.SERVO_RESPONSE, depth=2, partial="order_process_bar is 0 or 100, nothing between")
ANSWER_MAX = 20.0  # s after which the answer is a time-out, whatever the motion still does


@operations.on(
    Code.SERVO, partial="walks 303, 304, 305, 308; other gaits are answered 3008; pose and step height are not used"
)
async def servo(
    call: Call,
    *,
    motion_id: Int32,
    cmd_type: Int32 = CommandType.DATA,
    vel_des: list[float] = [],  # noqa: B006 - never changed
    cmd_id: Int32 | None = None,
) -> str:
    """One frame of the joystick: ``vel_des`` [x m/s, y m/s, yaw rad/s], kept for 200 ms. Answered by push 1003."""
    gaits = call.dog.gaits
    if cmd_type == CommandType.END:
        executed = gaits.end_servo()
    elif motion_id in GAITS:
        executed = gaits.servo(motion_id, twist_of(motion_id, vel_des))
    else:
        executed = Executed(MotionCode.UNSUPPORTED)
    response: dict[str, Any] = {
        "motion_id": motion_id,
        "result": executed.code is MotionCode.DONE,
        "code": int(executed.code),
        "status": int(executed.status),
        "order_process_bar": 0 if executed.status is SwitchStatus.CHANGING else 100,
    }
    call.dog.app.push(SERVO_RESPONSE, response if cmd_id is None else {**response, "cmd_id": cmd_id})
    return ""


@operations.on(
    Code.MOTION, partial="motions 0, 101, 102, 111, 112 and walks 303, 304, 305, 308; all others are answered 3008"
)
async def motion(call: Call, *, motion_id: Int32, vel_des: list[float] = [], duration: Int32 = 0) -> dict[str, Any]:  # noqa: B006
    """A motion that ends by itself; ``duration`` in ms, for walks alone. Answered when it has ended, within 20 s."""
    velocity = twist_of(motion_id, vel_des) if motion_id in GAITS else STILL
    performing = _perform(call.dog.gaits, motion_id, velocity, duration / 1000.0)
    try:
        code = await call.dog.robot.clock.wait_for(performing, ANSWER_MAX)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    return {"motion_id": motion_id, "result": code is MotionCode.DONE, "code": int(code)}


async def _perform(gaits: Gaits, motion: int, velocity: Twist, duration: float) -> MotionCode:
    """To the end of it; a walk of a robot that does not stand begins with standing up."""
    if refusal := gaits.check(motion, duration):
        return refusal
    steps = [(motion, velocity, duration)]
    if motion in GAITS and gaits.posture is not Posture.STANDING:
        steps.insert(0, (Motion.STAND_UP, STILL, 0.0))
    code = MotionCode.DONE
    for step in steps:
        begun = gaits.perform(*step)
        code = begun if isinstance(begun, MotionCode) else await gaits.ended(begun)
        if code is not MotionCode.DONE:
            break
    return code
