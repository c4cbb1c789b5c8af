"""Sections of a body's description for what sits on the chassis: gimbal, blaster, armor, lights, arm, sensors …

Metres, rad, seconds; ``above_belly`` is a height above the torso's underside, ``forward`` a way from the body's middle.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Positive = Annotated[float, Meta(gt=0, le=10_000)]
NotNegative = Annotated[float, Meta(ge=0, le=10_000)]
Offset = Annotated[float, Meta(ge=-5, le=5)]
Pair = tuple[Offset, Offset]
Count = Annotated[int, Meta(ge=1, le=32)]


class Gimbal(Struct, frozen=True, forbid_unknown_fields=True):
    """Where its axes cross, how far up, down and to both sides it turns, speed and acceleration of both axes."""

    forward: Offset
    above_belly: Offset
    up: Annotated[float, Meta(gt=0, lt=1.6)]
    down: Annotated[float, Meta(gt=0, lt=1.6)]
    sideways: Positive
    speed: Positive
    acceleration: Positive


class Blaster(Struct, frozen=True, forbid_unknown_fields=True):
    """``muzzle``: ahead of the gimbal's axes; ``spread``: one standard deviation, rad."""

    muzzle: Positive
    speed: Positive
    spread: Annotated[float, Meta(ge=0, le=0.5)]
    rate: Annotated[float, Meta(gt=0, le=50)]
    magazine: Annotated[int, Meta(ge=0, le=100_000)]


class Armor(Struct, frozen=True, forbid_unknown_fields=True):
    """Four plates (width, height) around the hull, their middles ``above_floor``; two at the gimbal, if there is one.

    ``gimbal_side``: how far those are from the gimbal's middle.
    """

    size: tuple[Positive, Positive]
    above_floor: NotNegative
    gimbal_size: tuple[Positive, Positive] = (0.06, 0.06)
    gimbal_side: Positive = 0.08


class Light(Struct, frozen=True, forbid_unknown_fields=True):
    """How many lamps each zone has."""

    zones: dict[str, Count]


class Skin(Struct, frozen=True, forbid_unknown_fields=True):
    """Turns dark and light in patches: three on the trunk, one on each leg with a foot."""


class Arm(Struct, frozen=True, forbid_unknown_fields=True):
    """Where the shoulder is, and what the end point can reach from there (x forward, z up)."""

    forward: Offset
    above_belly: Offset
    lowest: Pair
    highest: Pair
    radius: Positive
    home: Pair
    speed: Positive
    acceleration: Positive


class Gripper(Struct, frozen=True, forbid_unknown_fields=True):
    """Opening between the jaws, their length; speed (m/s) and force (N) that every level adds."""

    opening: Positive
    fingers: Positive
    speed: Positive
    force: Positive


class Servos(Struct, frozen=True, forbid_unknown_fields=True):
    """How many, how far to both sides (rad), how fast."""

    count: Count
    limit: Positive
    speed: Positive
    acceleration: Positive


class PwmPorts(Struct, frozen=True, forbid_unknown_fields=True):
    """How many; duty (0..1) and frequency (Hz) at power-on."""

    count: Count
    duty: Annotated[float, Meta(ge=0, le=1)]
    frequency: Positive


class SensorAdapters(Struct, frozen=True, forbid_unknown_fields=True):
    """How many with how many ports each; full scale and the voltage from which an input counts as high."""

    count: Count
    ports: Count
    voltage_max: Positive
    threshold: Positive


class RangeSensors(Struct, frozen=True, forbid_unknown_fields=True):
    """Sensors at the hull's edge, each looking outwards to its ``facings`` (rad); ``noise``: share of the distance."""

    facings: dict[str, Annotated[float, Meta(ge=-3.2, le=3.2)]]
    above_belly: Offset
    rate: Annotated[float, Meta(gt=0, le=50)]
    range_min: NotNegative
    range_max: Positive
    fov: Annotated[float, Meta(ge=0, le=1.5)]
    noise: Annotated[float, Meta(ge=0, le=0.5)]


class MotionStatus(Struct, frozen=True, forbid_unknown_fields=True):
    """``blow``: acceleration that counts as an impact, m/s2; ``told``: how long it is told, s."""

    blow: Positive
    told: Positive
