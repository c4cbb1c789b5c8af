"""Chapters "low power", "developer" and "calibration": 10002, 10003, 9031, 10006, 12001."""

from __future__ import annotations

from typing import Any

from roboglot.model.components.firmware import Firmware
from roboglot.model.components.legs import Legs, Posture
from roboglot.model.components.power import Power
from roboglot.model.errors import RobotError
from roboglot.protocols.cyberdog.gait import SOURCE
from roboglot.protocols.cyberdog.table import Call, operations
from roboglot.wire.cyberdog.codes import Code, InBandError, MachineState

WAKE_MAX = 13.0  # s that leaving low power may take
CALIBRATION_MAX = 10.0  # s
LAST_WORDS = 1.0  # s between the answer and the robot's going away


@operations.on(Code.LEAVE_LOW_POWER)
async def leave_low_power(call: Call) -> dict[str, Any]:
    """Answered when the robot is awake; an empty battery keeps it in low power."""
    power, clock = call.dog.robot[Power], call.dog.robot.clock
    waking = power.wake(source=SOURCE)
    try:
        await clock.wait_for(waking.done(), WAKE_MAX)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    return {"success": call.dog.gaits.state is not MachineState.LOW_POWER}


@operations.on(Code.AUTOMATIC_LOW_POWER)
async def switch_automatic_low_power(call: Call, *, data: bool) -> dict[str, bool]:
    """Whether a robot that lies for half a minute goes to low power."""
    await call.dog.robot[Power].set_automatic(data)
    return {"success": True}


@operations.on(Code.REBOOT)
async def reboot(call: Call) -> dict[str, int]:
    """``result`` in the text, ``reboot_result`` on real robots: 0. The connection ends soon after the answer."""
    call.dog.robot[Firmware].reboot(after=LAST_WORDS, source=SOURCE)
    return {"result": 0, "reboot_result": 0}


@operations.on(Code.POWER_OFF)
async def power_off(call: Call) -> dict[str, bool]:
    """Switch off soon after the answer; on again only by hand."""
    call.dog.robot[Power].shut_down(after=LAST_WORDS, source=SOURCE)
    return {"success": True}


@operations.on(Code.CALIBRATE_LEGS)
async def calibrate_legs(call: Call, *, data: bool) -> dict[str, Any]:
    """False: lie down and let the motors go; true: give them power again and stand."""
    legs, clock = call.dog.robot[Legs], call.dog.robot.clock
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
