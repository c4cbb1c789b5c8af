"""Types of the values between functions and programs, with the manual's field names and defaults (4.2).

Fields only; the groups' files fill them.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.programs.functions.enums import GESTURES
from roboglot.programs.worker.prelude import RecordType
from roboglot.programs.worker.values import Record


def _fields(names: str, default: object) -> dict[str, object]:
    """Return fields with a common default; ``names`` are separated by blanks."""
    return dict.fromkeys(names.split(), default)


_XYZ = {"x": 0.0, "y": 0.0, "z": 0.0}
_LEVEL = Record("Pose", {"orientation": Record("Quaternion", {"w": 0.0})})
_MOTION: Mapping[str, object] = {"motion_id": 0, "result": False, "code": 0}
# Results with a State and a ``response`` of these fields.
_RESPONSES: dict[str, dict[str, object]] = {
    "MotionSequenceServiceResponse": {"result": False, "code": 0, "describe": ""},
    "LedSeviceResponse": {"code": 0},
    "AudioPlaySeviceResponse": {"status": 100},
    "AudioGetVolumeSeviceResponse": {"volume": 0},
    "AudioSetVolumeSeviceResponse": {"success": False},
    "NavigationActionResponse": {"result": 3},
    "GestureRecognizedSeviceResponse": {"code": 0},
    "SkeletonRecognizedSeviceResponse": {"result": 0},
    "SkeletonRecognizedMessageResponse": {"algo_switch": 3, "sport_type": 0, "counts": 0, "duration": 0},
    "SportsRecognizedResponse": {"result": 0, "algo_switch": 3, "sport_type": 0, "counts": 0, "duration": 0},
}
RECORDS: dict[str, RecordType] = {
    # Some of the manual's examples read ``.state.code`` of a State itself.
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
    "MotionSequenceGait": RecordType(
        _fields("right_forefoot left_forefoot right_hindfoot left_hindfoot", True) | {"duration": 1000},
        constructible=True,
    ),
    "MotionSequencePace": RecordType(
        {"twist": Record("Twist"), "centroid": _LEVEL, "weight": Record("Twist")}
        | _fields("right_forefoot left_forefoot right_hindfoot left_hindfoot", Record("Quaternion", {"w": 0.0}))
        | {"use_mpc_track": False, "landing_gain": 1.0, "friction_coefficient": 0.8, "duration": 1000},
        constructible=True,
    ),
    "MotionSequence": RecordType({"name": "", "describe": "", "gait_list": [], "pace_list": []}, constructible=True),
    "ConnectorStatus": RecordType(
        {"is_connected": False, "is_internet": False}
        | _fields("ssid robot_ip provider_ip", "")
        | _fields("strength code", 0)
    ),
    "TouchStatus": RecordType({"header": Record("Header"), "touch_state": 0}),
    "GpsPayload": RecordType(_fields("sec nanosec itow fix_type num_sv", 0) | _fields("lon lat", 0.0)),
    "SingleTofPayload": RecordType(
        {"header": Record("Header"), "data_available": False, "tof_position": 0, "data": []}
    ),
    "HeadTofPayload": RecordType(_fields("left_head right_head", Record("SingleTofPayload"))),
    "RearTofPayload": RecordType(_fields("left_rear right_rear", Record("SingleTofPayload"))),
    "TofPayload": RecordType({"head": Record("HeadTofPayload"), "rear": Record("RearTofPayload")}),
    "Range": RecordType(
        {"header": Record("Header"), "radiation_type": 0} | _fields("field_of_view min_range max_range range", 0.0)
    ),
    "FaceRecognitionResult": RecordType({"result": 0, "username": "", "age": 0.0, "emotion": 0.0}),
    # One of the manual's examples reads the dictionary as ``response``.
    "FaceRecognizedSeviceResponse": RecordType(
        {"state": Record("State"), "list": [], "dictionary": {}}, {"response": "dictionary"}
    ),
    "VoiceprintRecognized": RecordType({"state": Record("State"), "list": [], "data": False}),
    "MsgPreset": RecordType({"label_name": "", "physic_x": 0.0, "physic_y": 0.0}),
    "MapPresetSeviceResponse": RecordType(
        {"state": Record("State"), "map_name": "", "is_outdoor": False, "list": [], "dictionary": {}}
    ),
    "GestureData": RecordType(dict.fromkeys(GESTURES, False)),
    "GestureRecognizedMessageResponse": RecordType({"state": Record("State"), "data": Record("GestureData")}),
    "MsgTrainingWords": RecordType(_fields("trigger type value", "")),
    "TrainingWordsRecognizedSeviceResponse": RecordType(
        {"state": Record("State"), "response": Record("TrainingSet"), "dictionary": {}}
    ),
    "TrainingSet": RecordType({"training_set": []}),
    "TrainingWordsRecognizedMessageResponse": RecordType(
        {"state": Record("State"), "response": Record("MsgTrainingWords")}
    ),
    **{name: RecordType({"state": Record("State"), "response": Record(f"{name}Body")}) for name in _RESPONSES},
    **{f"{name}Body": RecordType(fields) for name, fields in _RESPONSES.items()},
}
