"""Chapter "delivery": orders, boxes, stages and settings of the delivery service."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

import msgspec

ENTRIES_MAX = 50
SECONDS_MAX = 86_400
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=256)]
SpeedValue = Annotated[float, msgspec.Meta(gt=0, le=10)]
Clock = Annotated[str, msgspec.Meta(pattern=r"^([01]\d|2[0-3]):[0-5]\d:[0-5]\d$|^24:00:00$")]
VoiceText = Annotated[str, msgspec.Meta(max_length=4096)]


class DeliveryEvent(StrEnum):
    """Event of a delivery; all values of the manual."""

    START_FROM_DOCK = "START_FROM_DOCK"
    DELIVERY_SETTINGS_CHANGED = "DELIVERY_SETTINGS_CHANGED"
    DELIVERY_TASK_START = "DELIVERY_TASK_START"
    BACK_TO_RECEPTION_FOR_FAILED_ORDER = "BACK_TO_RECEPTION_FOR_FAILED_ORDER"
    DELIVERY_NO_PICKUP = "DELIVERY_NO_PICKUP"
    COLLECT_NO_PICKUP = "COLLECT_NO_PICKUP"
    UNDOCK_FAILED = "UNDOCK_FAILED"
    START_TO_WORK = "START_TO_WORK"
    GET_OFF_WORK = "GET_OFF_WORK"
    LOW_BATTERY = "LOW_BATTERY"
    ROBOT_REBOOT = "ROBOT_REBOOT"
    LOCALIZATION_ANOMALY = "LOCALIZATION_ANOMALY"
    NEW_TASK_RECEIVED = "NEW_TASK_RECEIVED"
    STATION_TASK_START = "STATION_TASK_START"
    OPERATING_CABINET = "OPERATING_CABINET"
    DISINFECT_TASK_FAILED = "DISINFECT_TASK_FAILED"


class CargoEntry(msgspec.Struct):
    """Boxes of one cargo by number, written as text ("000"); numbers are understood, too."""

    cargo_id: Name
    boxes: Annotated[list[Annotated[str, msgspec.Meta(pattern=r"^\d{1,6}$")] | int], msgspec.Meta(max_length=50)]


class Destination(msgspec.Struct):
    """Target and stops on the way."""

    poi_name: Name
    task_points: Annotated[list[Name], msgspec.Meta(max_length=ENTRIES_MAX)] = []


class TaskRequest(msgspec.Struct):
    """Body of POST tasks."""

    location: Destination
    type: Literal["TAKEOUT", "GUIDE", "FOOD_DELIVERY", "RETURN", "RECYCLE", "TAKEOUT_DISTRIBUTE"]
    cargos: Annotated[list[CargoEntry], msgspec.Meta(max_length=ENTRIES_MAX)] | None = None


class TaskError(msgspec.Struct):
    """Reason why a task was not created."""

    message: str


class TaskCreated(msgspec.Struct, omit_defaults=True):
    """Answer to POST tasks; a refusal has ``result`` false and status 200."""

    result: bool
    order_id: str = ""
    errors: list[TaskError] = []


class TasksCreated(msgspec.Struct, omit_defaults=True):
    """Answer to POST tasks/:batch, which creates all tasks or none."""

    result: bool
    order_ids: list[str] = []
    errors: list[TaskError] = []


class Untaken(msgspec.Struct):
    """Goods of a failed order left in boxes."""

    target: str
    cargos: list[CargoEntry]


class DeliveryTaskRequest(msgspec.Struct):
    """A task in the robot's reports; ``station_id``: the cabinet at which it begins."""

    target: str
    type: str
    req_id: str
    order_id: str
    no_pickup_wait: bool
    cargos: list[CargoEntry]
    failed_tasks: list[Untaken]
    station_id: str = ""
    station_cargos: list[CargoEntry] = []
    message: dict[str, str] = {}


class PickupResult(msgspec.Struct, omit_defaults=True):
    """Operation on a box or on a task point, never both."""

    result: Literal["SUCCEEDED", "FAILED"]
    cargo_id: str = ""
    box_id: str = ""
    reason: str = ""
    task_point_id: str = ""


class TaskResult(msgspec.Struct, omit_defaults=True, kw_only=True):
    """Progress of the task, without a stage before it begins, and the reason of a failure."""

    stage: str = ""
    reason: str
    pickup_result: list[PickupResult]
    timestamp: str


class DeliveryTask(msgspec.Struct):
    """A task and its result."""

    id: str
    task: DeliveryTaskRequest
    status: str
    result: TaskResult


class LocationInfo(msgspec.Struct, omit_defaults=True):
    """A place by its name and type."""

    poi_name: str
    type: str = ""


class DeviceError(msgspec.Struct):
    """A fault, with the codes of the health report."""

    component: int
    error_code: int
    error_level: int
    message: str


class Pickup(msgspec.Struct):
    """Number of boxes and their states."""

    num_total: int
    num_picked_up: int
    result: list[PickupResult]


class StageInfo(msgspec.Struct, omit_defaults=True):
    """Details of a stage: task and place, or faults; the whole task at the target."""

    id: str = ""
    status: str = ""
    result: TaskResult | None = None
    task: DeliveryTaskRequest | None = None
    location: LocationInfo | None = None
    errors: list[DeviceError] | None = None


class TaskStage(msgspec.Struct, omit_defaults=True):
    """State of the delivery service; ``stage`` decides which of the other fields are there."""

    stage: str
    milestone: str = ""
    current_floor: str = ""
    target_floor: str = ""
    info: StageInfo | None = None
    pickup: Pickup | None = None


class TaskExecution(msgspec.Struct):
    """Execution switch of tasks."""

    enable_task_execution: bool


class Box(msgspec.Struct):
    """Current state of a box."""

    id: int
    door_status: str
    lock_status: str
    stock_status: str
    status: str
    errors: list[str]


class Cargo(msgspec.Struct):
    """A group of boxes."""

    id: str
    pos: int
    orientation: str
    layer: int
    type: str
    errors: list[str]
    boxes: list[Box]


class OperationResult(msgspec.Struct):
    """The last operation of a box."""

    type: Literal["OPEN", "CLOSE"]
    stage: Literal["IN_PROGRESS", "DONE", "FAILED"]
    reason: str
    cargo_id: str
    box: Box


class AssignedCargo(msgspec.Struct):
    """Boxes assigned to a takeout."""

    target: str
    order_id: str
    cargo_id: str
    boxes: list[str]


class OperationReply(msgspec.Struct):
    """Result of an operation, as JSON; the manual calls it text/plain."""

    result: bool
    reason: str = ""


class Password(msgspec.Struct, omit_defaults=True):
    """Password of the screen; without ``expires`` it never expires."""

    enable: bool
    password: Annotated[str, msgspec.Meta(max_length=64)] = ""


class AdminPassword(msgspec.Struct):
    """The API's wrapper of Password."""

    delivery_admin_password: Password


class WorkModeEntry(msgspec.Struct):
    """Kinds of tasks that may be created at the robot."""

    work_mode: Literal["DISPATCH", "RECYCLE", "MANUAL"]


class Language(msgspec.Struct):
    """Language of screen and voice."""

    language: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]


class Hours(msgspec.Struct):
    """One working period, HH:MM:SS."""

    start_time: Clock
    end_time: Clock


class WorkingTime(msgspec.Struct):
    """Periods of a day, and days off (0 Sunday … 6 Saturday)."""

    hours: Annotated[list[Hours], msgspec.Meta(max_length=ENTRIES_MAX)] = []
    restdays: Annotated[list[Annotated[int, msgspec.Meta(ge=0, le=6)]], msgspec.Meta(max_length=7)] = []


class LineSpeed(msgspec.Struct):
    """Speeds, m/s; None: unchanged."""

    delivery_speed: SpeedValue | None = None
    return_speed: SpeedValue | None = None


class Configuration(msgspec.Struct):
    """Machine description."""

    device_sn: str
    firmware_version: str
    is_manage_by_cloud: bool
    enable_recovery_on_parking: bool
    cargos: list[Cargo]


class BatteryLevels(msgspec.Struct):
    """Battery levels, percent: off, home, no cloud tasks, no takeouts."""

    level1: int
    level2: int
    level3: int
    level4: int


class Timeouts(msgspec.Struct):
    """Time-outs, s."""

    takeout_pickup_timeout: int
    takeout_open_door_timeout: int
    collect_pickup_timeout: int
    brake_released_timeout: int
    food_pickup_timeout: int


class DeliverySettings(msgspec.Struct):
    """Levels and time-outs."""

    low_battery_level: BatteryLevels
    timeout_settings: Timeouts


class WrappedSettings(msgspec.Struct):
    """The API's wrapper of DeliverySettings."""

    delivery_settings: DeliverySettings


class TimeoutChange(msgspec.Struct):
    """The only time-out that can be set."""

    food_pickup_timeout: Annotated[int, msgspec.Meta(ge=1, le=SECONDS_MAX)]


class VoicePackage(msgspec.Struct):
    """A voice package of the cloud."""

    version: VoiceText
    content: VoiceText
    interval_count: int = 0
    play_type: int = 0
    repeat_count: int = 0


class VoicePackages(msgspec.Struct):
    """Voice packages in the form of the cloud's answer."""

    result: bool
    msg: str
    data: list[VoicePackage]
