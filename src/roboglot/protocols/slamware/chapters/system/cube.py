"""Chapter "system": the configuration of the machine, kept over restarts.

The vendor's tool exports it in a binary format that is not public; such a file is refused. Accepted
is a JSON object of our own: ``max_moving_speed`` (m/s) and ``max_angular_speed`` (rad/s), values of these parameters
after every restart, and ``disabled_sensors``, the ids of sensors that are always off.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.speed_limits import CONFIGURED
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.validation import decode_json, why_invalid

ID_MAX, IDS_MAX = 10_000, 1000
Speed = Annotated[float, msgspec.Meta(gt=0, le=10)]


class CubeConfig(msgspec.Struct, forbid_unknown_fields=True):
    """Configurable values; missing ones are those of the robot's build."""

    max_moving_speed: Speed | None = None
    max_angular_speed: Speed | None = None
    disabled_sensors: Annotated[
        list[Annotated[int, msgspec.Meta(ge=0, le=ID_MAX)]], msgspec.Meta(max_length=IDS_MAX)
    ] = []


@TABLE.on(
    "PUT /api/core/system/v1/cube/config",
    partial="the format that the vendor's tool exports is not public and refused; a JSON object of our own configures",
    right=Right.EDIT,
    needs=(Base, Settings),
    some=(SensorMasks,),
)
async def set_cube_config(context: Context, body: bytes) -> None:
    """Configure the machine; 400 for unknown settings or values beyond the robot's limits."""
    robot = context.robot
    robot.require(Base, Settings)
    try:
        config = decode_json(body, CubeConfig)
    except msgspec.DecodeError as error:
        raise InvalidGoal(
            f"this robot cannot read the configuration: {why_invalid(error, wanted=CubeConfig)}"
        ) from None
    if config.disabled_sensors:
        known = {sensor.id for sensor in robot[SensorMasks].sensors}
        if missing := set(config.disabled_sensors) - known:
            raise NotFound(f"there are no sensors {sorted(missing)[:20]}")
    context.limits.check(config.max_moving_speed, config.max_angular_speed)
    speeds = {CONFIGURED: [config.max_moving_speed, config.max_angular_speed]}
    await context.masks.set_masks(lambda _: dict.fromkeys(config.disabled_sensors, True), speeds)
    context.limits.reset()
