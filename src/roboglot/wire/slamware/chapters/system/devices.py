"""Chapters "system" and "sensors": power, parameters, lights, sensors that are switched off."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

import msgspec

Minutes = Annotated[int, msgspec.Meta(ge=0, le=30 * 24 * 60)]


class Shutdown(msgspec.Struct):
    """Minutes until the robot is off, and from then until it starts again (0: never)."""

    shutdown_time_interval: Minutes = 0
    restart_time_interval: Minutes = 0


class RestartMode(StrEnum):
    """Device to restart."""

    SOFT = "RestartModeSoft"
    HARD = "RestartModeHard"
    BASE = "RestartModeBase"


class Restart(msgspec.Struct):
    """Device to restart."""

    mode: RestartMode = RestartMode.SOFT


Speed = Literal["base.max_moving_speed", "base.max_angular_speed"]
Readable = Literal[Speed, "docking.docked_register_strategy"]
Settable = Literal[Speed, "base.emergency_stop", "base.brake_release"]


class Parameter(msgspec.Struct):
    """A parameter and its new value, as text."""

    param: Settable
    value: Annotated[str, msgspec.Meta(max_length=64)] | float


ColourPart = Annotated[int, msgspec.Meta(ge=0, le=255)]


Milliseconds = Annotated[int, msgspec.Meta(ge=0, le=600_000)]


class Channel(StrEnum):
    """Channel of the strips."""

    ONE = "One"
    TWO = "Two"


class Half(StrEnum):
    """Side of the robot."""

    LEFT = "Left"
    RIGHT = "Right"


class Mode(StrEnum):
    """Pattern of the strips."""

    ALWAYS_BRIGHT = "AlwaysBright"
    BREATHE = "Breathe"
    BLINK = "Blink"
    HORSE_LAMP = "HorseLamp"


class LightColour(msgspec.Struct):
    """Colour, each part from 0 to 255."""

    red: ColourPart = 0
    green: ColourPart = 0
    blue: ColourPart = 0


class LightControl(msgspec.Struct, rename="camel"):
    """Light of a strip; ``bright_ms``: step of breathing, bright time of a blink, or time per lamp."""

    channel: Channel
    control_part: Half
    mode: Mode
    color: LightColour
    brightness_end_color: LightColour | None = None
    bright_ms: Milliseconds = 0
    off_ms: Milliseconds = 0


class DisabledSensor(msgspec.Struct, rename="camel"):
    """A disabled sensor; ``is_always`` false: until the robot restarts."""

    id: int
    is_always: bool


class SensorSwitch(msgspec.Struct, rename="camel"):
    """Switch a sensor."""

    id: Annotated[int, msgspec.Meta(ge=0, le=10_000)]
    is_enabled: bool
    is_always: bool = False
