"""The types that functions hand to programs, with the manual's field names and defaults (4.2).

Only shapes and codes; what fills them is in the groups' files.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

from roboglot.model.geometry import Orientation, Vector3
from roboglot.programs.worker.prelude import RecordType
from roboglot.programs.worker.values import Record


class StateCode(IntEnum):
    """How an ability's last call went (4.2, StateCode); the shipped firmware's 79xx numbers are not used."""

    INVALID = -1
    SUCCESS = 0
    FAIL = 1
    NO_DATA_UPDATE = 0x20
    COMMAND_WAITING_EXECUTE = 0x30
    SERVICE_CLIENT_INTERRUPTED = 0x40
    SERVICE_APPEAR_TIMEOUT = 0x41
    SERVICE_REQUEST_INTERRUPTED = 0x42
    SERVICE_REQUEST_TIMEOUT = 0x43
    SPIN_FUTURE_INTERRUPTED = 0x50
    SPIN_FUTURE_TIMEOUT = 0x51


def state(code: StateCode = StateCode.SUCCESS, describe: str = "success") -> Record:
    """A State."""
    return Record("State", {"code": int(code), "describe": describe})


def point(x: float, y: float, z: float = 0.0) -> Record:
    """A Point, m."""
    return Record("Point", {"x": x, "y": y, "z": z})


def vector(value: Vector3) -> Record:
    """A Vector3 in the unit of its field."""
    return Record("Vector3", {"x": value.x, "y": value.y, "z": value.z})


def header(epoch: float, frame: str) -> Record:
    """A Header: seconds since 1970 and the frame of what follows."""
    nanoseconds = round(epoch * 1e9)
    stamp = Record("Time", {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9})
    return Record("Header", {"stamp": stamp, "frame_id": frame})


def quaternion(attitude: Orientation) -> Record:
    """A Quaternion of roll, pitch, yaw in rad (turned about the fixed axes in this order)."""
    cr, sr = math.cos(attitude.roll / 2), math.sin(attitude.roll / 2)
    cp, sp = math.cos(attitude.pitch / 2), math.sin(attitude.pitch / 2)
    cy, sy = math.cos(attitude.yaw / 2), math.sin(attitude.yaw / 2)
    return Record(
        "Quaternion",
        {
            "x": sr * cp * cy - cr * sp * sy,
            "y": cr * sp * cy + sr * cp * sy,
            "z": cr * cp * sy - sr * sp * cy,
            "w": cr * cp * cy + sr * sp * sy,
        },
    )


def _fields(names: str, default: object) -> dict[str, Any]:
    """Fields with a common default; ``names`` are parted by blanks."""
    return dict.fromkeys(names.split(), default)


_XYZ = {"x": 0.0, "y": 0.0, "z": 0.0}
_MOTION: Mapping[str, Any] = {"motion_id": 0, "result": False, "code": 0}
RECORDS: dict[str, RecordType] = {
    # Some of the manual's examples read ``.state.code`` of what is a State itself.
    "State": RecordType({"code": 0, "describe": "success"}, {"state": ""}),
    "Time": RecordType(_fields("sec nanosec", 0)),
    "Header": RecordType({"stamp": Record("Time"), "frame_id": ""}),
    "Point": RecordType(_XYZ),
    "Vector3": RecordType(_XYZ),
    "Quaternion": RecordType(_XYZ | {"w": 1.0}),
    "Pose": RecordType({"position": Record("Point"), "orientation": Record("Quaternion")}),
    "PoseWithCovariance": RecordType({"pose": Record("Pose"), "covariance": [0.0] * 36}),
    "Twist": RecordType({"linear": Record("Vector3"), "angular": Record("Vector3")}),
    "TwistWithCovariance": RecordType({"twist": Record("Twist"), "covariance": [0.0] * 36}),
    "Odometry": RecordType(
        {
            "header": Record("Header"),
            "child_frame_id": "",
            "pose": Record("PoseWithCovariance"),
            "twist": Record("TwistWithCovariance"),
        }
    ),
    "Imu": RecordType(
        {
            "header": Record("Header"),
            "orientation": Record("Quaternion"),
            "orientation_covariance": [0.0] * 9,
            "angular_velocity": Record("Vector3"),
            "angular_velocity_covariance": [0.0] * 9,
            "linear_acceleration": Record("Vector3"),
            "linear_acceleration_covariance": [0.0] * 9,
        }
    ),
    "LaserScan": RecordType(
        {"header": Record("Header")}
        | _fields("angle_min angle_max angle_increment time_increment scan_time range_min range_max", 0.0)
        | {"ranges": [], "intensities": []}
    ),
    "BmsStatus": RecordType(
        {"header": Record("Header")}
        | _fields(
            "batt_volt batt_curr batt_soc batt_temp batt_st key_val disable_charge power_supply buzze status"
            " batt_health batt_loop_number powerboard_status",
            0,
        )
        | _fields(
            "power_normal power_wired_charging power_finished_charging power_motor_shutdown power_soft_shutdown"
            " power_wp_place power_wp_charging power_expower_supply",
            False,
        )
    ),
    "DefaultAndMaximum": RecordType({"minimum_value": 0.0, "default_value": 0.0, "maximum_value": 0.0, "unit": ""}),
    "MotionParams": RecordType(
        _fields(
            "centroid_x centroid_y centroid_z fulcrum_x fulcrum_y fulcrum_z roll pitch yaw x_velocity y_velocity"
            " z_velocity front_leg_lift back_leg_lift distance duration delta",
            Record("DefaultAndMaximum"),
        )
    ),
    "MotionResult": RecordType(_MOTION),
    "MotionResultServiceResponse": RecordType({"state": Record("State"), "response": Record("MotionResult")}),
    "MotionServoCmd": RecordType({**_MOTION, "order_process_bar": 0, "status": 0}),
    "MotionServoCmdResponse": RecordType({"state": Record("State"), "response": Record("MotionServoCmd")}),
}

ENUMS = {"StateCode": {code.name.lower(): int(code) for code in StateCode}}
