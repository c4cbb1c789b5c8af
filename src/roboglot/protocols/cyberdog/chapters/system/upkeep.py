"""Chapters "low power", "developer", "environment", "logs" and "calibration": 10002 to 10006, 9030, 9031, 12001."""

from __future__ import annotations

from roboglot.model.components.energy.power import Power
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.system.developer import Developer
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.settings import Settings
from roboglot.model.components.system.system_log import SystemLog
from roboglot.model.errors import InvalidGoal, NotFound, Refused, RobotError
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.chapters.system.bracelet import LEFT
from roboglot.protocols.cyberdog.chapters.system.stored_settings import ENVIRONMENT
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.codes import Code, InBandError, MachineState, TaskState, UnlockResult

WAKE_MAX = 13.0  # s to leave low power
CALIBRATION_MAX = 10.0  # s
UPLOAD_MAX = 59.0  # s
UNLOCK_MAX = 10.0  # s
ENVIRONMENTS = ("pro", "test")
LAST_WORDS = 1.0  # s between the answer and the shutdown


@TABLE.on(Code.LEAVE_LOW_POWER, right=Right.DRIVE, needs=(Power,))
async def leave_low_power(call: Call) -> dict[str, object]:
    """Leave low power; answered once awake. An empty battery prevents it."""
    power, clock = call.context.robot[Power], call.context.robot.clock
    waking = power.wake(source=SOURCE)
    try:
        await clock.wait_for(waking.done(), WAKE_MAX)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    if call.context.gaits.state is MachineState.LOW_POWER:
        return call.refused({"success": False}, waking.reason or "the charge is too low")
    return {"success": True}


@TABLE.on(Code.AUTOMATIC_LOW_POWER, right=Right.EDIT, needs=(Power,))
async def switch_automatic_low_power(call: Call, *, data: bool) -> dict[str, bool]:
    """Switch the automatic low power of a robot that lies for half a minute."""
    await call.context.robot[Power].set_automatic(data)
    return {"success": True}


@TABLE.on(Code.WORK_ENVIRONMENT, right=Right.ADMIN, needs=(Settings,))
async def set_work_environment(call: Call, *, data: str) -> dict[str, object]:
    """Set production ("pro") or "test"; stored only, as simulated robots have the same manufacturer in both."""
    if data not in ENVIRONMENTS:
        return {"success": False, "message": f"the environment is {' or '.join(ENVIRONMENTS)}"}
    await call.context.robot[Settings].put(ENVIRONMENT, data)
    return {"success": True, "message": ""}


@TABLE.on(Code.UPLOAD_LOG, right=Right.ADMIN, needs=(SystemLog,))
async def upload_log(call: Call) -> dict[str, object]:
    """Upload the system's log to the manufacturer; false without internet access."""
    action = call.context.robot[SystemLog].upload(source=SOURCE)
    try:
        await call.context.robot.clock.wait_for(action.succeeded(), UPLOAD_MAX)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    except RobotError as error:
        return call.refused({"success": False}, str(error))
    finally:
        action.cancel(LEFT)
    return {"success": True}


@TABLE.on(Code.UPLOAD_MOTION_LOG, right=Right.ADMIN, needs=(SystemLog,))
async def upload_motion_log(call: Call) -> dict[str, object]:
    """Upload the motion board's log (not in the manual), which here is the system's."""
    answer = await upload_log(call)
    return answer if "error_code" in answer else {**answer, "message": ""}


@TABLE.on(Code.SWITCH_POINT_CLOUD, right=Right.EDIT, needs=(DepthCamera,))
async def switch_point_cloud(call: Call, *, data: bool) -> dict[str, object]:
    """Switch the depth camera, which detects obstacles (not in the manual); refused while a bracelet is followed."""
    camera = call.context.robot[DepthCamera]
    if call.context.tasks.state is TaskState.TAG_FOLLOWING:
        return {"success": False, "message": "the robot follows a bracelet"}
    camera.enable(data)
    return {"success": True, "message": ""}


@TABLE.on(Code.POINT_CLOUD, right=Right.SEE, needs=(DepthCamera,))
async def point_cloud(call: Call) -> dict[str, object]:
    """Return whether the depth camera is on (not in the manual)."""
    return {"success": call.context.robot[DepthCamera].enabled, "message": ""}


@TABLE.on(Code.UNLOCK, right=Right.ADMIN, needs=(Developer,))
async def unlock(call: Call, *, httplink: str = "") -> dict[str, int]:
    """Unlock developer access with the key at a link. ``result`` in the manual, ``unlock_result`` on robots."""
    result = UnlockResult.DONE
    try:
        await call.context.robot.clock.wait_for(call.context.robot[Developer].unlock(httplink), UNLOCK_MAX)
    except InvalidGoal as error:
        result, call.why = UnlockResult.ARGUMENTS, str(error)
    except NotFound as error:
        result, call.why = UnlockResult.OTHER_ROBOT, str(error)
    except (Refused, TimeoutError) as error:
        result, call.why = UnlockResult.NOT_UNLOCKED, str(error) or "the link did not answer"
    return {"result": int(result), "unlock_result": int(result)}


@TABLE.on(Code.REBOOT, right=Right.ADMIN, needs=(Firmware,))
async def reboot(call: Call) -> dict[str, int]:
    """Reboot soon after the answer: ``result`` 0 in the manual, ``reboot_result`` 0 on real robots."""
    call.context.robot[Firmware].reboot(after=LAST_WORDS, source=SOURCE)
    return {"result": 0, "reboot_result": 0}


@TABLE.on(Code.POWER_OFF, right=Right.ADMIN, needs=(Power,))
async def power_off(call: Call) -> dict[str, bool]:
    """Switch off soon after the answer; on again only by hand."""
    call.context.robot[Power].shut_down(after=LAST_WORDS, source=SOURCE)
    return {"success": True}


@TABLE.on(Code.CALIBRATE_LEGS, right=Right.ADMIN, needs=(Legs,))
async def calibrate_legs(call: Call, *, data: bool) -> dict[str, object]:
    """Lie down and release the motors (false); power them again and stand (true)."""
    legs, clock = call.context.robot[Legs], call.context.robot.clock
    if not data and legs.posture is Posture.LIMP:
        return {"success": True, "message": ""}
    action = legs.stand(source=SOURCE) if data else legs.lie_down(source=SOURCE)
    try:
        await clock.wait_for(action.succeeded(), CALIBRATION_MAX)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    except RobotError as error:
        return {"success": False, "message": str(error)}
    if not data:
        legs.go_limp()
    return {"success": True, "message": ""}
