"""Sections of a body's description: what companions feel and talk to. Read into ``body.Body``. SI units."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

MOTORS_MAX = 64
SENSORS_MAX = 16

Offset = Annotated[float, Meta(ge=-5, le=5)]
Angle = Annotated[float, Meta(ge=-3.2, le=3.2)]
Positive = Annotated[float, Meta(gt=0, le=10_000)]
NotNegative = Annotated[float, Meta(ge=0, le=10_000)]


class Eye(Struct, frozen=True, forbid_unknown_fields=True):
    """Where a sensor sits on the torso: ahead, left, above the belly (m), turned by yaw and pitch (nose down)."""

    name: Annotated[str, Meta(min_length=1, max_length=30)]
    forward: Offset
    above_belly: Offset
    left: Offset = 0.0
    yaw: Angle = 0.0
    pitch: Angle = 0.0


class TimeOfFlight(Struct, frozen=True, forbid_unknown_fields=True):
    """Grids of 8 x 8 zones over a square ``field_of_view`` (rad)."""

    rate: Annotated[float, Meta(gt=0, le=60)]
    field_of_view: Annotated[float, Meta(gt=0, lt=2)]
    range_min: NotNegative
    range_max: Positive
    noise: NotNegative
    sensors: Annotated[tuple[Eye, ...], Meta(min_length=1, max_length=SENSORS_MAX)]


class TrafficRadio(Struct, frozen=True, forbid_unknown_fields=True):
    """Tells other robots what this one claims, as far as ``range`` m."""

    range: Annotated[float, Meta(gt=0, le=10_000)] = 500.0


class Vision(Struct, frozen=True, forbid_unknown_fields=True):
    """Detectors that look at the camera's pictures ``rate`` times a second."""

    rate: Annotated[float, Meta(gt=0, le=30)] = 12.5


class Hearing(Struct, frozen=True, forbid_unknown_fields=True):
    """Understands what the microphone hears."""


class Reflectors(Struct, frozen=True, forbid_unknown_fields=True):
    """A lidar that tells reflecting foil from other things."""


class Touch(Struct, frozen=True, forbid_unknown_fields=True):
    """A pad on the head."""


class Gps(Struct, frozen=True, forbid_unknown_fields=True):
    """``noise``: one standard deviation of the position under the open sky, m; ``search``: s until the first fix."""

    rate: Annotated[float, Meta(gt=0, le=20)]
    noise: NotNegative
    search: NotNegative


class Motors(Struct, frozen=True, forbid_unknown_fields=True):
    """``warming``: kelvin that each motor warms up by, in the long run, per watt of its share of the load."""

    names: Annotated[tuple[str, ...], Meta(min_length=1, max_length=MOTORS_MAX)]
    warming: Positive
    inertia: Positive  # s, the time constant


class Bluetooth(Struct, frozen=True, forbid_unknown_fields=True):
    """``sensitivity``: dBm from which it hears; ``connect_time`` in s."""

    sensitivity: Annotated[float, Meta(ge=-120, le=0)] = -92.0
    connect_time: NotNegative = 2.0


class UltraWideband(Struct, frozen=True, forbid_unknown_fields=True):
    """Standard deviations of distance (m) and azimuth (rad) in sight."""

    range_max: Positive
    noise: NotNegative
    angle_noise: NotNegative
    rate: Annotated[float, Meta(gt=0, le=50)] = 10.0


class Firmware(Struct, frozen=True, forbid_unknown_fields=True):
    """``modules``: factory versions; ``offered``: what the maker offers; rates in bytes per s, ``reboot_time`` in s."""

    version: str
    modules: dict[str, str]
    offered: str = ""
    offered_size: Annotated[int, Meta(ge=0, le=4 * 1024**3)] = 0
    download_rate: Annotated[float, Meta(gt=0, le=1e9)] = 2e7
    install_rate: Annotated[float, Meta(gt=0, le=1e9)] = 5e7
    reboot_time: Positive = 20.0


class Power(Struct, frozen=True, forbid_unknown_fields=True):
    """``idle_time``: s of lying until low power; ``wake_time`` in s; ``saving``: share of the idle power then."""

    automatic: bool = False
    idle_time: Positive = 30.0
    wake_time: Positive = 4.0
    saving: Annotated[float, Meta(ge=0, le=1)] = 0.3
