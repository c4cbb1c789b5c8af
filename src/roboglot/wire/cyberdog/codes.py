"""The numbers of the protocol: message codes, in-band errors, tasks and their feedback. Knows no messages."""

from collections.abc import Mapping
from enum import IntEnum


class Code(IntEnum):
    """``nameCode``: kind of a message."""

    DEVICE_INFO = 1001
    SERVO = 1002
    SERVO_RESPONSE = 1003
    MOTION = 1004
    SWITCH_NICKNAME = 1010
    SET_NICKNAME = 1011
    SET_VOLUME = 1012
    SET_MICROPHONE = 1013
    SET_VOICE_CONTROL = 1014
    SET_EYE_LIGHT = 1015
    ADD_MEMBER = 1020
    FIND_MEMBERS = 1021
    DELETE_MEMBER = 1022
    SYNCHRONISE_MEMBERS = 1023
    RENAME_MEMBER = 1024
    STOP_SOUND = 1025
    ALIGN_WITH_STAIRS = 1100
    END_STAIR_ALIGNMENT = 1101
    PROGRAM_TO_APP = 2001
    PROGRAM_TO_ROBOT = 2002
    AUDIO_IDENTITY = 3001
    AUDIO_TOKEN = 3002
    TRAIN_VOICE = 3011
    CANCEL_VOICE = 3012
    VOICE_TRAINED = 3013
    VOICEPRINTS = 3014
    VIDEO = 4001
    CAMERA = 4002
    LEFT_FILES = 4003
    SAVED_FILE = 4004
    DISK_LOW = 4005
    UPDATE_STATUS = 5001
    UPDATE_VERSION = 5002
    DOWNLOAD_UPDATE = 5003
    INSTALL_UPDATE = 5004
    UPDATE_PROGRESS = 5005
    UPDATE_TIME = 5006
    UPDATE_REBOOT = 5007
    UPDATE_RESULT = 5008
    START_UPDATE = 5010
    JOIN_UPDATE = 5011
    MAP = 6001
    SET_LABELS = 6002
    GET_LABELS = 6003
    START_TASK = 6004
    POSE = 6005
    PATH = 6006
    TRACKING = 6007
    CHOOSE_TARGET = 6008
    STOP_TASK = 6009
    JOIN_TASK = 6010
    LASER = 6011
    SWITCH_POINT_CLOUD = 6012
    POINT_CLOUD = 6013
    ENTER_FACE = 7001
    RECOGNISE_FACES = 7002
    FACE_ENTERED = 7003
    FACE_RECOGNISED = 7004
    SCAN_BLUETOOTH = 8001
    CONNECT_BLUETOOTH = 8002
    BLUETOOTH_LOST = 8003
    BLUETOOTH_CONNECTED = 8004
    BLUETOOTH_FIRMWARE = 8005
    BLUETOOTH_BATTERY = 8006
    FORGET_BLUETOOTH = 8007
    BLUETOOTH_UPDATE_OFFERED = 8008
    UPDATE_BLUETOOTH = 8009
    BLUETOOTH_UPDATE_PROGRESS = 8010
    SET_GEAR = 8011
    GEAR_CHANGED = 8012
    GEAR = 8013
    UNLOCK = 9030
    REBOOT = 9031
    STATUS = 10001
    LEAVE_LOW_POWER = 10002
    AUTOMATIC_LOW_POWER = 10003
    WORK_ENVIRONMENT = 10004
    UPLOAD_LOG = 10005
    POWER_OFF = 10006
    UPLOAD_MOTION_LOG = 10007
    ENABLE_SKIN = 11001
    SET_SKIN = 11002
    CALIBRATE_LEGS = 12001
    DISCONNECT_APP = 55001


# Codes of real robots that are missing from the published text.
UNPUBLISHED = frozenset({1100, 1101, 2001, 2002, 5002, 5010, 5011, 6012, 6013, 10006, 10007, 11001, 11002})
# Codes of the text that no real robot knows.
TEXT_ONLY = frozenset({1015, 1023, 4005, 5008})
# Operations whose stream a real robot ends silently without their service; others answer UNAVAILABLE.
SILENT_WITHOUT_SERVICE = frozenset(
    {1001, *range(1020, 1025), 3001, 3002, 3011, 3012, 3014, 5001, 5002, 5003, 5004, 5006, 7001, 7002, 9030, 9031}
)

# Requests that without fields disconnect or forget a device: of these, other JSON than an object is refused, and an
# object that has only unknown fields.
WITH_FIELDS = frozenset({Code.CONNECT_BLUETOOTH, Code.FORGET_BLUETOOTH})

# Fields that have no effect on real dogs either, by request.
UNUSED: Mapping[int, frozenset[str]] = {
    Code.SERVO: frozenset({"cmd_source", "acc_des", "ctrl_point", "foot_pose", "contact", "duration"}),
    Code.MOTION: frozenset({"cmd_source", "cmd_type", "acc_des", "ctrl_point", "foot_pose", "value"}),
    Code.SET_LABELS: frozenset({"is_outdoor"}),
    Code.START_UPDATE: frozenset({"user", "type", "depth"}),
}


class InBandError(IntEnum):
    """``{"error_code": n}`` in an answer; the gRPC status stays OK."""

    TIMEOUT = 321
    UNAVAILABLE = 322
    BAD_PARAMETERS = 323


class FileError(IntEnum):
    """``FileChunk.error_code``, and ``result`` of 4002 by sendMsg."""

    NONE = 0
    ARGUMENTS = 1
    UNSUPPORTED = 2
    BUSY = 4
    STATE = 5
    INNER = 6
    CAMERA_SILENT = 7
    NOT_THERE = 9
    TOO_MANY = 10
    WRONG_CODE = 255


class AccountCode(IntEnum):
    """``success`` of 1020, 1022 and 1024, ``code`` of 1021."""

    DONE = 0
    UNKNOWN = 121
    DATABASE = 122


class UnlockResult(IntEnum):
    """``result`` of 9030."""

    DONE = 0
    ARGUMENTS = 1
    OTHER_ROBOT = 2
    NOT_UNLOCKED = 5


class PrintState(IntEnum):
    """``face_state`` and ``voice_state`` of a member."""

    NONE = 0
    ENTERED = 1
    BEING_ENTERED = 2


class TaskType(IntEnum):
    """``type`` of 6004, 6009 and 6010."""

    ALL = 0
    NAVIGATION = 1
    MAPPING = 5
    LOCALIZATION = 7
    DOCKING = 9
    UWB_FOLLOWING = 11
    VISION_FOLLOWING = 13


class TaskState(IntEnum):
    """``task_status`` of the heartbeat and of 10001."""

    NAVIGATING = 1
    THING_FOLLOWING = 3
    MAPPING = 5
    LOCALIZATION_FAILED = 6
    LOCALIZING = 7
    LOCALIZED = 8
    DOCKING = 9
    TAG_FOLLOWING = 11
    FOLLOWING = 13
    OUTDOOR_MAPPING = 15
    OUTDOOR_LOCALIZATION_FAILED = 16
    OUTDOOR_LOCALIZING = 17
    OUTDOOR_LOCALIZED = 18
    OUTDOOR_NAVIGATING = 21
    IDLE = 101
    STOPPING = 103


class Accepted(IntEnum):
    """The first answer of 6004 and 6010."""

    YES = 1
    NO = 2
    NOTHING_TO_JOIN = 3


class TaskResult(IntEnum):
    """The last answer of 6004 and 6010."""

    SUCCESS = 0
    FAILED = 3
    CANCELED = 5


class StopResult(IntEnum):
    """The answer of 6009."""

    STOPPED = 0
    FAILED = 1
    NO_ANSWER = 10


class Feedback(IntEnum):
    """``feedback_code`` of a running task."""

    MAPPING_STARTED = 6
    MAPPING_FAILED = 7
    TAG_FOLLOWED = 10
    TAG_LOST = 11
    TAG_CONTROL_FAILED = 14
    TAG_NOT_THERE = 15
    PLANNING = 300
    NAVIGATION_FAILED = 304
    NO_PATH = 306
    NAVIGATING = 307
    ARRIVED = 308
    CHECKING_MAP = 309
    MAP_GOOD = 310
    NO_MAP = 311
    DOCKING = 500
    FOLLOW_STARTING = 500  # the same number is used in another task
    FOLLOW_WAITS_FOR_CHOICE = 501
    FOLLOW_CHOSEN = 502
    FOLLOWING = 503
    TARGET_SEARCHED = 504
    TARGET_LOST = 505
    TARGET_NOT_LOCKED = 507
    ACTIVATING = 1000
    ACTIVATED = 1001
    ACTIVATION_FAILED = 1002
    LOCALIZATION_CHECKING_MAP = 3100
    LOCALIZATION_MAP_GOOD = 3101
    LOCALIZATION_MAP_UNUSABLE = 3102
    LOCALIZATION_STARTING = 3103
    LOCALIZATION_STARTED = 3104
    LOCALIZATION_TIMEOUT = 3106
    LOCALIZATION_TRYING = 3107
    LOCALIZATION_DONE = 3108
    LOCALIZATION_FAILED = 3109


class SkinMode(IntEnum):
    """``mode`` of 11002. ``wave_cycle_time``: ms; for FOOTFALLS, legs on the floor are light at 0, otherwise dark."""

    DARK = 0
    LIGHT = 1
    REARWARD = 2
    FORWARD = 3
    FLASH = 4
    RANDOM = 5
    FOOTFALLS = 6


class MachineState(IntEnum):
    """``state_switch_status.state``."""

    ACTIVE = 0
    PROTECTED = 1
    LOW_POWER = 2
    UPDATING = 3
    SHUT_DOWN = 4


class SelfCheck(IntEnum):
    """``self_check_status.code``."""

    GOOD = 0
    CHECKING = 1
    CRITICAL_FAULT = 2
    MINOR_FAULT = 4
