"""Chapter "slam": localization, mapping, IMU. Docks and maps have files of their own."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.imu import Imu, ImuConverters
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import require_heard
from roboglot.model.sensing import ImuReading, RawImu
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.system.raw_imu import in_units
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import milliseconds, pose3d, pose_of
from roboglot.wire.slamware.chapters.slam.localization import (
    IMU_ACCELEROMETER,
    IMU_EULER,
    IMU_GYROSCOPE,
    IMU_QUATERNION,
    IMU_RAW,
    ImuData,
    Switch,
)
from roboglot.wire.slamware.geometry import COORDINATE_MAX, Location, Pose3D, Quaternion, Rectangle

API = "/api/core/slam/v1"
NOT_LOCALIZED = "not localized"  # the fault
Bound = Annotated[float, msgspec.Meta(ge=-COORDINATE_MAX, le=COORDINATE_MAX)]


@TABLE.on(f"GET {API}/localization/pose", right=Right.SEE, needs=(Localization,))
def get_pose(context: Context) -> Pose3D:
    """Return the robot's pose in the map."""
    require_heard(context.robot)
    return pose3d(context.robot[Localization].pose)


@TABLE.on(f"PUT {API}/localization/pose", right=Right.DRIVE, needs=(Localization,))
def set_pose(context: Context, body: Pose3D) -> None:
    """Set the robot's pose in the map."""
    context.robot[Localization].set_pose(pose_of(body))


@TABLE.on(f"GET {API}/localization/odopose", right=Right.SEE, needs=(Odometry,))
def get_odo_pose(context: Context) -> Pose3D:
    """Return the robot's pose by its wheels, from where it started."""
    require_heard(context.robot)
    return pose3d(context.robot[Odometry].reading.pose)


@TABLE.on(f"GET {API}/localization/quality", right=Right.SEE, needs=(Localization,))
def get_localization_quality(context: Context) -> int:
    """Return the fit of the lidar's scans to the map, 0..100."""
    require_heard(context.robot)
    return round(context.robot[Localization].quality * 100)


@TABLE.on(f"GET {API}/localization/:enable", right=Right.SEE, needs=(Localization,))
def get_map_localization(context: Context) -> bool:
    """Return whether the lidar corrects the pose."""
    return context.robot[Localization].enabled


@TABLE.on(f"PUT {API}/localization/:enable", right=Right.EDIT, needs=(Localization,))
def set_map_localization(context: Context, body: Switch) -> bool:
    """Switch the correction of the pose by the lidar; off, it follows the wheels alone."""
    context.robot[Localization].enable(body.enable)
    return True


@TABLE.on(f"POST {API}/localization/status/:reset", right=Right.DRIVE, needs=(Localization,))
def reset_localization_status(context: Context) -> bool:
    """Restart localization at the current pose, searched in a wide circle by the lidar."""
    robot = context.robot
    robot[Localization].set_pose(robot[Localization].pose)
    if Health in robot:
        for fault in robot[Health].faults:
            if fault.name == NOT_LOCALIZED:
                robot[Health].dismiss(fault.id)  # raised again if it persists
    return True


@TABLE.on(f"GET {API}/mapping/:enable", right=Right.SEE, needs=(Mapping,))
def get_map_update(context: Context) -> bool:
    """Return whether the lidar updates the map."""
    return context.robot[Mapping].enabled


@TABLE.on(f"PUT {API}/mapping/:enable", right=Right.EDIT, needs=(Mapping,))
def set_map_update(context: Context, body: Switch) -> bool:
    """Switch updates of the map by the lidar."""
    context.robot[Mapping].enable(body.enable)
    return True


@TABLE.on(f"GET {API}/loopclosure/:enable", right=Right.SEE, needs=(Mapping,))
def get_loop_closure(context: Context) -> bool:
    """Return whether loop closures correct the map."""
    return context.robot[Mapping].closes_loops


@TABLE.on(f"PUT {API}/loopclosure/:enable", right=Right.EDIT, needs=(Mapping,))
def set_loop_closure(context: Context, body: Switch) -> bool:
    """Switch loop closures."""
    context.robot[Mapping].close_loops(body.enable)
    return True


@TABLE.on(f"GET {API}/imu", right=Right.SEE, needs=(Imu,))
def get_imu(context: Context) -> ImuData:
    """Return attitude (rad), acceleration (m/s2) and turning rates (rad/s) in the robot's frame."""
    require_heard(context.robot)
    robot = context.robot
    raw = robot[ImuConverters].raw if ImuConverters in robot else None
    return imu_data(robot[Imu].reading, raw, robot.starts.base)


@TABLE.on(f"GET {API}/knownarea", right=Right.SEE, needs=(Mapping,))
def get_known_area(context: Context) -> Rectangle:
    """Return the extent of the map, m."""
    grid = context.robot[Mapping].grid
    return Rectangle(grid.origin.x, grid.origin.y, grid.width * grid.resolution, grid.height * grid.resolution)


def imu_data(reading: ImuReading, raw: RawImu | None = None, base_start: float = 0.0) -> ImuData:
    """Return ``reading`` with its quaternion, its time since ``base_start`` (robot time).

    The calibrated compass, and a missing ``raw``, are marked unavailable.
    """
    attitude, turning, acceleration = reading.orientation, reading.angular_velocity, reading.linear_acceleration
    (cr, sr), (cp, sp), (cy, sy) = (
        (math.cos(half), math.sin(half)) for half in (attitude.roll / 2, attitude.pitch / 2, attitude.yaw / 2)
    )
    nothing = Location(0.0, 0.0, 0.0)
    available = IMU_QUATERNION | IMU_ACCELEROMETER | IMU_GYROSCOPE | IMU_EULER
    raw_acceleration, raw_rate, raw_field = nothing, nothing, nothing
    if raw is not None:
        raw_acceleration, raw_rate, raw_field = (Location(*values) for values in in_units(raw))
        available |= IMU_RAW
    return ImuData(
        acc=Location(acceleration.x, acceleration.y, acceleration.z),
        gyro=Location(turning.x, turning.y, turning.z),
        euler_angle=Location(attitude.roll, attitude.pitch, attitude.yaw),
        quaternion=Quaternion(
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ),
        compass=nothing,
        raw_acc=raw_acceleration,
        raw_gyro=raw_rate,
        raw_compass=raw_field,
        timestamp=milliseconds(reading.stamp, base_start),
        vendor_availability=available,
        availability=available,
    )
