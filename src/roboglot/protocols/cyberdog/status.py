"""Chapter "status": what the robot tells about itself: 1001, 10001, the heartbeat's Ticks; the test code 55001."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from roboglot.model.components.battery import Battery
from roboglot.model.components.legs import Posture
from roboglot.model.components.network import Network
from roboglot.protocols.cyberdog.dog import Dog
from roboglot.protocols.cyberdog.self_check import self_check
from roboglot.protocols.cyberdog.table import Call, operations
from roboglot.protocols.cyberdog.vocabulary import percent, wifi_strength
from roboglot.wire.cyberdog.codes import Code, SelfCheck
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.text import write

NO_SERVICE = -255  # a volume of a robot that has no speaker


@dataclass(frozen=True, slots=True)
class Status:
    """What 10001 and the heartbeat have in common."""

    motion_id: int
    task_status: int
    task_sub_status: int
    self_check: SelfCheck
    self_check_description: str
    state: int
    wired_charging: bool
    wireless_charging: bool


def status_of(dog: Dog) -> Status:
    """Now, from the model."""
    check, errors = self_check(dog.robot)
    battery = dog.robot[Battery].state if Battery in dog.robot else None
    return Status(
        motion_id=int(dog.gaits.motion),
        task_status=int(dog.tasks.state),
        task_sub_status=dog.tasks.last_feedback,
        self_check=check,
        self_check_description=write(errors),
        state=int(dog.gaits.state),
        wired_charging=battery is not None and battery.wired_charging,
        wireless_charging=battery is not None and battery.dock_charging,
    )


def ticks(dog: Dog, address: str) -> Any:
    """One heartbeat; ``address`` is where the app finds the robot."""
    status = status_of(dog)
    return pb.Ticks(
        ip=address,
        wifi_strength=wifi_strength(dog.robot[Network].signal) if Network in dog.robot else 0,
        battery_power=percent(dog.robot[Battery].state.percentage) if Battery in dog.robot else 0,
        internet=False,  # nobody here looks beyond the robot's own network
        sn=dog.robot.description.serial,
        motion_status=pb.MotionStatus(motion_id=status.motion_id),
        task_status=pb.TaskStatus(task_status=status.task_status, task_sub_status=status.task_sub_status),
        self_check_status=pb.SelfCheckStatus(code=int(status.self_check), description=status.self_check_description),
        state_switch_status=pb.StateSwitchStatus(state=status.state, code=0),
        charging_status=pb.ChargingStatus(
            wired_charging=status.wired_charging, wireless_charging=status.wireless_charging
        ),
        audio=False,  # no voice board
    )


@operations.on(Code.STATUS)
async def query_status(call: Call) -> dict[str, Any]:
    """The states of the heartbeat, on request."""
    status = status_of(call.dog)
    return {
        "motion_status": {"motion_id": status.motion_id},
        "task_status": {"task_status": status.task_status, "task_sub_status": status.task_sub_status},
        "self_check_status": {"code": int(status.self_check), "description": status.self_check_description},
        "state_switch_status": {"state": status.state, "code": 0},
        "charging_status": {
            "wired_charging": status.wired_charging,
            "wireless_charging": status.wireless_charging,
        },
    }


def _battery(dog: Dog) -> dict[str, Any]:
    if Battery not in dog.robot:
        return {}
    state = dog.robot[Battery].state
    return {
        "power": percent(state.percentage),
        "voltage": round(1000.0 * state.voltage),  # mV
        "temperature": round(state.temperature),
        "is_charging": state.charging,
    }


def _wifi(dog: Dog) -> dict[str, Any]:
    strength = wifi_strength(dog.robot[Network].signal) if Network in dog.robot else 0
    return {"name": "", "ip": dog.address, "mac": "", "strength": strength}


INFORMATION: Mapping[str, Callable[[Dog], Any]] = {
    "version": lambda dog: {
        "new_version": dog.robot.description.software_version,
        "nx_debs": {"sw-version": dog.robot.description.software_version},
    },
    "sn": lambda dog: dog.robot.description.serial,
    "nick_name": lambda dog: {"default_name": dog.robot.description.model, "current_name": dog.robot.id},
    "volume": lambda dog: NO_SERVICE,
    "mic_state": lambda dog: False,  # there is neither microphone nor voice control
    "voice_control": lambda dog: False,
    "wifi": _wifi,
    "bat_info": _battery,
    "motor_temper": lambda dog: dict.fromkeys(("hip", "thigh", "crus"), "unavalible"),  # spelt as robots do
    "audio_state": lambda dog: False,
    "device_model": lambda dog: dog.robot.description.model,
    "stand": lambda dog: dog.gaits.posture is Posture.STANDING,
    "lowpower_control": lambda dog: False,  # it never lies down to sleep by itself
}


@operations.on(
    Code.DEVICE_INFO,
    partial="no motor temperatures, Wi-Fi name and MAC, battery capacity and time left, versions of single boards; "
    "nickname is the robot's configured name; no sound",
)
async def device_information(
    call: Call,
    *,
    is_version: bool = False,
    is_sn: bool = False,
    is_nick_name: bool = False,
    is_volume: bool = False,
    is_mic_state: bool = False,
    is_voice_control: bool = False,
    is_wifi: bool = False,
    is_bat_info: bool = False,
    is_motor_temper: bool = False,
    is_audio_state: bool = False,
    is_device_model: bool = False,
    is_stand: bool = False,
    is_lowpower_control: bool = False,
) -> dict[str, Any]:
    """Only what was asked for, and always "non-standing", as robots in the field do."""
    wanted = (
        is_version,
        is_sn,
        is_nick_name,
        is_volume,
        is_mic_state,
        is_voice_control,
        is_wifi,
        is_bat_info,
        is_motor_temper,
        is_audio_state,
        is_device_model,
        is_stand,
        is_lowpower_control,
    )
    answer = {key: tell(call.dog) for (key, tell), yes in zip(INFORMATION.items(), wanted, strict=True) if yes}
    return {**answer, "non-standing": call.dog.gaits.posture is not Posture.STANDING}


@operations.on(Code.DISCONNECT_APP)
async def disconnect_app(call: Call) -> str:
    """Forget the app's address: heartbeats and pushes end until the next request comes."""
    call.dog.app.forget()
    return ""
