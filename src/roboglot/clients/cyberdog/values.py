"""Values of the robot, with its names and units (m, rad, percent, mV, Celsius). Unknown fields are ignored."""

from __future__ import annotations

from typing import Any

import msgspec

from roboglot.wire.cyberdog.codes import Code


class Value(msgspec.Struct):
    """Base of all messages."""


class Pose(Value):
    """6005: pose in the map frame, m, with the heading as a quaternion."""

    px: float
    py: float
    pz: float = 0.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    qw: float = 1.0


class Grid(Value):
    """6001: rows from the smallest y; -1 unknown, 0 free, 100 occupied. ``resolution``: m a cell."""

    resolution: float
    width: int
    height: int
    px: float
    py: float
    data: list[int]


class XY(Value):
    """A point of the map, m."""

    px: float
    py: float


class PlannedPath(Value):
    """6006: planned path; empty when it is over."""

    path_point: list[XY]


class LaserPoints(Value):
    """6011: points of the laser in the map frame, m."""

    laser_point: list[XY]


class Label(Value):
    """A named point of a map, m."""

    labelName: str  # noqa: N815 - the wire's names
    physicX: float  # noqa: N815
    physicY: float  # noqa: N815


class LabelledMap(Value):
    """6003: a map with its labels; ``success``: 0, or the code of the reason why there is none."""

    mapName: str  # noqa: N815
    success: int
    locationLabelInfo: list[Label]  # noqa: N815
    map: Grid
    is_outdoor: bool = False


class ServoResponse(Value):
    """1003: result of a servo frame."""

    motion_id: int
    result: bool
    code: int
    status: int = 0
    order_process_bar: int = 0
    cmd_id: int | None = None


class Region(Value):
    """A part of a picture of 640 by 480 pixels."""

    x_offset: int
    y_offset: int
    height: int
    width: int


class TrackedBody(Value):
    """One person in the picture."""

    roi: Region
    reid: str


class Tracking(Value):
    """6007."""

    body_info_roi: list[TrackedBody]
    track_res_roi: Region


class FaceEntered(Value):
    """7003: result of entering a face."""

    result: int
    username: str = ""


class FaceRecognised(Value):
    """7004: recognised face; ``result``: 0, or 5907 without a face. ``age`` in years."""

    username: str
    result: int
    id: int = 0
    age: float = 0.0
    emotion: float = 0.0


class VoiceTrained(Value):
    """3013: result of training a voice."""

    code: int
    voiceprint_id: str = ""


class VoiceprintsWanted(Value):
    """3014: request for ``send_voiceprints``."""


class FilesLeft(Value):
    """4003: files that were not fetched completely."""

    file_name: list[str]


class DiskLow(Value):
    """4005: free bytes on the disk."""

    remain_size: int


class UpdateStatus(Value):
    """5001: state of an update."""

    status: str
    code: int = 0


class UpdateProgress(Value):
    """5005: percent, or -1 and -2 for failures."""

    download_progress: int
    upgrade_progress: int
    code: int = 0


class UpdateReboots(Value):
    """5007: the robot restarts."""


class UpdateResult(Value):
    """5008: result of an update."""

    success: bool
    code: int = 0


class BluetoothLost(Value):
    """8003: a bluetooth connection was lost, or is back."""

    disconnected: bool


class BluetoothUpdateOffered(Value):
    """8008: versions of an offered update, "old new"."""

    data: str


class BluetoothUpdateProgress(Value):
    """8010: ``progress`` 0..1; ``status``: 0 begun, 1 well, 2 failed.

    Also 3 unpacking, 5 starting, 7 sending, 9 restarting; one more: failed in that stage.
    """

    status: int
    progress: float
    message: str = ""


class GearChanged(Value):
    """8012: 0 slow, 1 middle, 2 fast."""

    data: int


class Device(Value):
    """A bluetooth device; ``battery_level`` 0..1."""

    mac: str
    name: str = ""
    addr_type: str = ""
    device_type: int = 0
    firmware_version: str = ""
    battery_level: float = 0.0


class Member(Value):
    """``face_state``, ``voice_state``: 0 none, 1 entered, 2 being entered."""

    name: str
    id: int = 0
    face_state: int = 0
    voice_state: int = 0


class ProgramFrame(Value):
    """2001: a frame of visual programming, unchanged."""

    feedback: dict[str, Any] = {}
    block: dict[str, object] | None = None
    response: dict[str, object] | None = None


PUSHED: dict[Code, type[Value]] = {
    Code.SERVO_RESPONSE: ServoResponse,
    Code.PROGRAM_TO_APP: ProgramFrame,
    Code.VOICE_TRAINED: VoiceTrained,
    Code.VOICEPRINTS: VoiceprintsWanted,
    Code.LEFT_FILES: FilesLeft,
    Code.DISK_LOW: DiskLow,
    Code.UPDATE_STATUS: UpdateStatus,
    Code.UPDATE_PROGRESS: UpdateProgress,
    Code.UPDATE_REBOOT: UpdateReboots,
    Code.UPDATE_RESULT: UpdateResult,
    Code.MAP: Grid,
    Code.POSE: Pose,
    Code.PATH: PlannedPath,
    Code.TRACKING: Tracking,
    Code.LASER: LaserPoints,
    Code.FACE_ENTERED: FaceEntered,
    Code.FACE_RECOGNISED: FaceRecognised,
    Code.BLUETOOTH_LOST: BluetoothLost,
    Code.BLUETOOTH_UPDATE_OFFERED: BluetoothUpdateOffered,
    Code.BLUETOOTH_UPDATE_PROGRESS: BluetoothUpdateProgress,
    Code.GEAR_CHANGED: GearChanged,
}
