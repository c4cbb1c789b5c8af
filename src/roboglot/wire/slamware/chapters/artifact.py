"""Chapter "artifact": points of interest (also the form of docks and landmarks), lines and areas."""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Annotated

import msgspec

from roboglot.validation import decode_json, why_invalid
from roboglot.wire.slamware.geometry import COORDINATE_MAX, Point, Pose2D, Pose3D

ID_MAX = 64
METADATA_MAX = 64  # entries
METADATA_TEXT_MAX = 4096  # characters

Identifier = Annotated[str, msgspec.Meta(min_length=1, max_length=ID_MAX)]
# For new entries: an id that can stand in a path, where a colon starts the name of a command.
NewIdentifier = Annotated[
    str, msgspec.Meta(min_length=1, max_length=ID_MAX, pattern=r"\A[^:\x00-\x1f\x7f][^\x00-\x1f\x7f]*\Z")
]
_Text = Annotated[str, msgspec.Meta(max_length=METADATA_TEXT_MAX)]
_Key = Annotated[str, msgspec.Meta(max_length=ID_MAX)]
# By the manual, values are text, but clients also send numbers, and [] for none.
Metadata = (
    Annotated[dict[_Key, _Text | int | float | bool | None], msgspec.Meta(max_length=METADATA_MAX)]
    | Annotated[list[None], msgspec.Meta(max_length=0)]
    | None
)


class PoseEntry(msgspec.Struct, omit_defaults=True):
    """A pose with a client-made id (a UUID) and free metadata. Without a pose: the robot's current one."""

    id: NewIdentifier
    pose: Pose2D | None = None
    metadata: Metadata = None


class PoseChange(msgspec.Struct):
    """New pose, new metadata, or both; what is absent stays."""

    pose: Pose3D | None = None
    metadata: Metadata = None


def metadata_text(metadata: Metadata) -> dict[str, str]:
    """Return the metadata with every value as text; values that are not text become JSON."""
    if not isinstance(metadata, dict):
        return {}
    return {k: v if isinstance(v, str) else msgspec.json.encode(v).decode() for k, v in metadata.items()}


class LineUsage(StrEnum):
    """Kind of a line."""

    TRACKS = "tracks"
    WALLS = "walls"


class AreaUsage(StrEnum):
    """Kind of an area."""

    FORBIDDEN = "forbidden_area"
    ELEVATOR = "elevator_area"
    DANGEROUS = "dangerous_area"
    COVERAGE = "coverage_area"
    MAINTENANCE = "maintenance_area"
    SENSOR_DISABLE = "sensor_disable_area"
    RESTRICTED = "restricted_area"


class Line(msgspec.Struct):
    """Line from ``start`` to ``end``; a Bézier curve if the metadata have ``control_point1`` and ``control_point2``."""

    start: Point
    end: Point
    id: int = 0
    metadata: Metadata = None


Lines = Annotated[list[Line], msgspec.Meta(max_length=10_000)]


class Strip(msgspec.Struct):
    """Area around a centre line, ``half_width`` m to both sides."""

    start: Point
    end: Point
    half_width: Annotated[float, msgspec.Meta(ge=0, le=COORDINATE_MAX)]


class AreaRequest(msgspec.Struct):
    """A new area."""

    area: Strip
    metadata: Metadata = None


class AreaChange(msgspec.Struct):
    """New place, new metadata, or both; what is absent stays."""

    area: Strip | None = None
    metadata: Metadata = None


class RectangleArea(msgspec.Struct):
    """A stored area."""

    id: int
    usage: AreaUsage
    area: Strip
    metadata: dict[str, str]


class MetadataError(ValueError):
    """A value in the metadata is invalid; the message names it."""


def with_control_points(
    metadata: dict[str, str], first: tuple[float, float], second: tuple[float, float]
) -> dict[str, str]:
    """Return a line's metadata with other control points."""
    texts = (f"{{'x':{round(x, 6) + 0.0!r},'y':{round(y, 6) + 0.0!r}}}" for x, y in (first, second))
    return metadata | dict(zip(("control_point1", "control_point2"), texts, strict=True))


def control_points(metadata: dict[str, str]) -> tuple[Point, Point] | None:
    """Return a curve's control points, None for a straight line. Raises MetadataError.

    They are written as ``{'x':0.1,'y':0.1}``, in single or double quotes.
    """
    texts = [metadata.get(key) for key in ("control_point1", "control_point2")]
    if texts == [None, None]:
        return None
    try:
        first, second = (decode_json((text or "").replace("'", '"'), Point) for text in texts)
    except msgspec.DecodeError as error:
        raise MetadataError(f"control_point1 and control_point2: {why_invalid(error)}") from None
    return first, second


def number(metadata: dict[str, str], key: str, most: float) -> float | None:
    """Return a number from 0 to ``most``, written as text; None if missing. Raises MetadataError."""
    if (text := metadata.get(key, "")) == "":
        return None
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= most:
        raise MetadataError(f"{key} is a number up to {most:g}, not {text[:40]}")
    return value


WORDS = {"dangerous_area_type": ("0", "1"), "elevator_door_type": ("0", "1", "2")}
LENGTHS = ("elevator_sill_width", "elevator_scheduling_point_dist")
LENGTH_MAX = 10.0  # m


def check_settings(metadata: dict[str, str]) -> None:
    """Raise MetadataError for words and lengths of an area that a robot would replace by its defaults."""
    for key, words in WORDS.items():
        if (word := metadata.get(key)) and word not in words:
            raise MetadataError(f"{key} is one of {', '.join(words)}, not {word[:40]}")
    for key in LENGTHS:
        number(metadata, key, LENGTH_MAX)


SENSOR_TYPES = ("bumper", "cliff", "sonar", "depth camera")


def sensor_types(metadata: dict[str, str]) -> frozenset[str]:
    """Return the sensors of a ``sensor_type`` like ``[0,3]``, with any kind of comma. Raises MetadataError."""
    text = metadata.get("sensor_type", "")
    if not re.fullmatch(r"\s*\[?[\s0-9,，、]*\]?\s*", text[:100]):
        raise MetadataError("sensor_type is a list like [0,3]")
    numbers = [int(found) for found in re.findall("[0-9]+", text[:100])]
    if any(n >= len(SENSOR_TYPES) for n in numbers):
        raise MetadataError(f"sensor_type has numbers up to {len(SENSOR_TYPES) - 1}")
    return frozenset(SENSOR_TYPES[n] for n in numbers)
