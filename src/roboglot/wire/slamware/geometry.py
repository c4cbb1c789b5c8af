"""Poses, points and rectangles of the Slamware API. Bounded, so that no number can do harm later."""

from __future__ import annotations

from typing import Annotated

import msgspec

COORDINATE_MAX = 1e5  # m; far beyond any map
ANGLE_MAX = 1e4  # rad; headings may include full turns

Metres = Annotated[float, msgspec.Meta(ge=-COORDINATE_MAX, le=COORDINATE_MAX)]
Radians = Annotated[float, msgspec.Meta(ge=-ANGLE_MAX, le=ANGLE_MAX)]


class Point(msgspec.Struct):
    """A place in the plane, m."""

    x: Metres
    y: Metres


class Location(msgspec.Struct):
    """A place in space, m; robots on wheels ignore z. Also used for any three components."""

    x: Metres
    y: Metres
    z: Metres = 0.0


class Pose2D(msgspec.Struct):
    """Position (m) and heading (rad) in the map."""

    x: Metres
    y: Metres
    yaw: Radians = 0.0


class Pose3D(msgspec.Struct):
    """Position (m) and attitude (rad) in the map."""

    x: Metres
    y: Metres
    z: Metres = 0.0
    yaw: Radians = 0.0
    pitch: Radians = 0.0
    roll: Radians = 0.0


class Quaternion(msgspec.Struct):
    """Unit quaternion."""

    w: float
    x: float
    y: float
    z: float


class Rectangle(msgspec.Struct):
    """Axis-parallel rectangle: the corner with the smallest x and y, and the extent, m."""

    x: float
    y: float
    width: float
    height: float
