"""Chapters "system" and "sensors": emergency braking, jack, depth camera, sensors switched off."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated

import msgspec

from roboglot.model.components.logistics.jack import JACK, Jack, JackStage
from roboglot.model.components.motion.emergency_braking import EmergencyBraking
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import NotFound
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.slam.localization import Switch
from roboglot.wire.slamware.chapters.system.devices import DisabledSensor, SensorSwitch

SYSTEM, SENSORS = "/api/core/system/v1", "/api/core/sensors/v1"
LOWEST, HIGHEST = 31, 26_000_001  # counts of the jack's drive at the ends, as seen on robots
STAGES = {JackStage.DOWN: 2, JackStage.MOVING: 3, JackStage.STOPPED: 4, JackStage.UP: 5}


class OnOff(StrEnum):
    """A switch."""

    ON = "On"
    OFF = "Off"


class JackCommand(StrEnum):
    """Commands to the jack. The manual's table has the first four, its example "On"."""

    UP = "Up"
    DOWN = "Down"
    STOP = "Stop"
    CLEAR_ALARM = "ClearAlarm"
    ON = "On"
    OFF = "Off"


class JackStatus(msgspec.Struct):
    """``stage``: 2 down, 3 moving, 5 up, 4 in between; ``drv_status``: whether the drive turns."""

    actual_pos: int
    alarm: int
    drv_status: int
    stage: int


@TABLE.on(f"POST {SYSTEM}/aeb/control", right=Right.EDIT, needs=(EmergencyBraking,))
def set_aeb_control(context: Context, body: OnOff) -> None:
    """Switch automatic emergency braking."""
    context.robot[EmergencyBraking].enable(body is OnOff.ON)


@TABLE.on(f"POST {SYSTEM}/jack/status", right=Right.DRIVE, needs=(Jack,))
def set_jack_req(context: Context, body: JackCommand) -> None:
    """Lift (Up, On), set down (Down, Off), stop, or acknowledge the alarm."""
    jack = context.robot[Jack]
    match body:
        case JackCommand.UP | JackCommand.ON:
            jack.raise_platform(source=SOURCE)
        case JackCommand.DOWN | JackCommand.OFF:
            jack.lower_platform(source=SOURCE)
        case JackCommand.STOP:
            for action in context.robot.actions.running(JACK):
                action.cancel()
        case JackCommand.CLEAR_ALARM:
            jack.clear_alarm()


@TABLE.on(f"GET {SYSTEM}/jack/status", right=Right.SEE, needs=(Jack,))
def get_jack_status(context: Context) -> JackStatus:
    """Return the position and state of the jack's platform."""
    jack = context.robot[Jack]
    counts = LOWEST + round(jack.position / jack.stroke * (HIGHEST - LOWEST))
    return JackStatus(counts, int(bool(jack.alarm)), int(jack.stage is JackStage.MOVING), STAGES[jack.stage])


@TABLE.on(f"PUT {SENSORS}/depth/:enable", right=Right.EDIT, needs=(DepthCamera,))
def set_depth_sensor_state(context: Context, body: Switch) -> None:
    """Switch the depth camera."""
    context.robot[DepthCamera].enable(body.enable)


@TABLE.on(f"GET {SENSORS}/masks", right=Right.SEE, needs=(SensorMasks,))
def get_disabled_sensors_mask_data(context: Context) -> list[DisabledSensor]:
    """Return the sensors that are switched off."""
    return [DisabledSensor(id, always) for id, always in sorted(context.robot[SensorMasks].masked.items())]


@TABLE.on(f"PUT {SENSORS}/masks", right=Right.EDIT, needs=(SensorMasks, Settings))
async def set_sensor_mask(context: Context, body: Annotated[list[SensorSwitch], msgspec.Meta(max_length=1000)]) -> bool:
    """Switch sensors off and on, all or none; 404 if one does not exist."""
    masks = context.robot[SensorMasks]
    if missing := {switch.id for switch in body} - {sensor.id for sensor in masks.sensors}:
        raise NotFound(f"there are no sensors {sorted(missing)[:20]}")
    changes = {switch.id: None if switch.is_enabled else switch.is_always for switch in body}

    def edit(before: Mapping[int, bool]) -> dict[int, bool]:
        return {id: always for id, always in {**before, **changes}.items() if always is not None}

    await context.masks.set_masks(edit)
    return True
