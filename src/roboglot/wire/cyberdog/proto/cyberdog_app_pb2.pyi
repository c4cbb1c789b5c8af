from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class SendRequest(_message.Message):
    __slots__ = ("nameCode", "params")
    NAMECODE_FIELD_NUMBER: _ClassVar[int]
    PARAMS_FIELD_NUMBER: _ClassVar[int]
    nameCode: int
    params: str
    def __init__(self, nameCode: _Optional[int] = ..., params: _Optional[str] = ...) -> None: ...

class RecResponse(_message.Message):
    __slots__ = ("nameCode", "data")
    NAMECODE_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    nameCode: int
    data: str
    def __init__(self, nameCode: _Optional[int] = ..., data: _Optional[str] = ...) -> None: ...

class Result(_message.Message):
    __slots__ = ("result",)
    RESULT_FIELD_NUMBER: _ClassVar[int]
    result: str
    def __init__(self, result: _Optional[str] = ...) -> None: ...

class FileChunk(_message.Message):
    __slots__ = ("error_code", "file_name", "file_size", "buffer")
    ERROR_CODE_FIELD_NUMBER: _ClassVar[int]
    FILE_NAME_FIELD_NUMBER: _ClassVar[int]
    FILE_SIZE_FIELD_NUMBER: _ClassVar[int]
    BUFFER_FIELD_NUMBER: _ClassVar[int]
    error_code: int
    file_name: str
    file_size: int
    buffer: bytes
    def __init__(self, error_code: _Optional[int] = ..., file_name: _Optional[str] = ..., file_size: _Optional[int] = ..., buffer: _Optional[bytes] = ...) -> None: ...

class Ticks(_message.Message):
    __slots__ = ("ip", "wifi_strength", "battery_power", "internet", "sn", "motion_status", "task_status", "self_check_status", "state_switch_status", "charging_status", "audio")
    IP_FIELD_NUMBER: _ClassVar[int]
    WIFI_STRENGTH_FIELD_NUMBER: _ClassVar[int]
    BATTERY_POWER_FIELD_NUMBER: _ClassVar[int]
    INTERNET_FIELD_NUMBER: _ClassVar[int]
    SN_FIELD_NUMBER: _ClassVar[int]
    MOTION_STATUS_FIELD_NUMBER: _ClassVar[int]
    TASK_STATUS_FIELD_NUMBER: _ClassVar[int]
    SELF_CHECK_STATUS_FIELD_NUMBER: _ClassVar[int]
    STATE_SWITCH_STATUS_FIELD_NUMBER: _ClassVar[int]
    CHARGING_STATUS_FIELD_NUMBER: _ClassVar[int]
    AUDIO_FIELD_NUMBER: _ClassVar[int]
    ip: str
    wifi_strength: int
    battery_power: int
    internet: bool
    sn: str
    motion_status: MotionStatus
    task_status: TaskStatus
    self_check_status: SelfCheckStatus
    state_switch_status: StateSwitchStatus
    charging_status: ChargingStatus
    audio: bool
    def __init__(self, ip: _Optional[str] = ..., wifi_strength: _Optional[int] = ..., battery_power: _Optional[int] = ..., internet: _Optional[bool] = ..., sn: _Optional[str] = ..., motion_status: _Optional[_Union[MotionStatus, _Mapping]] = ..., task_status: _Optional[_Union[TaskStatus, _Mapping]] = ..., self_check_status: _Optional[_Union[SelfCheckStatus, _Mapping]] = ..., state_switch_status: _Optional[_Union[StateSwitchStatus, _Mapping]] = ..., charging_status: _Optional[_Union[ChargingStatus, _Mapping]] = ..., audio: _Optional[bool] = ...) -> None: ...

class MotionStatus(_message.Message):
    __slots__ = ("motion_id",)
    MOTION_ID_FIELD_NUMBER: _ClassVar[int]
    motion_id: int
    def __init__(self, motion_id: _Optional[int] = ...) -> None: ...

class TaskStatus(_message.Message):
    __slots__ = ("task_status", "task_sub_status")
    TASK_STATUS_FIELD_NUMBER: _ClassVar[int]
    TASK_SUB_STATUS_FIELD_NUMBER: _ClassVar[int]
    task_status: int
    task_sub_status: int
    def __init__(self, task_status: _Optional[int] = ..., task_sub_status: _Optional[int] = ...) -> None: ...

class SelfCheckStatus(_message.Message):
    __slots__ = ("code", "description")
    CODE_FIELD_NUMBER: _ClassVar[int]
    DESCRIPTION_FIELD_NUMBER: _ClassVar[int]
    code: int
    description: str
    def __init__(self, code: _Optional[int] = ..., description: _Optional[str] = ...) -> None: ...

class StateSwitchStatus(_message.Message):
    __slots__ = ("state", "code")
    STATE_FIELD_NUMBER: _ClassVar[int]
    CODE_FIELD_NUMBER: _ClassVar[int]
    state: int
    code: int
    def __init__(self, state: _Optional[int] = ..., code: _Optional[int] = ...) -> None: ...

class ChargingStatus(_message.Message):
    __slots__ = ("wired_charging", "wireless_charging")
    WIRED_CHARGING_FIELD_NUMBER: _ClassVar[int]
    WIRELESS_CHARGING_FIELD_NUMBER: _ClassVar[int]
    wired_charging: bool
    wireless_charging: bool
    def __init__(self, wired_charging: _Optional[bool] = ..., wireless_charging: _Optional[bool] = ...) -> None: ...
