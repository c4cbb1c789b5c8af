"""Chapter "status": the robot's state: 1001, 10001, the heartbeat's Ticks; the test code 55001."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.motion.legs import Posture
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.network import Network
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.people.audio import activated
from roboglot.protocols.cyberdog.chapters.system.self_check import self_check
from roboglot.protocols.cyberdog.chapters.system.stored_settings import DEFAULT_NAME, nickname
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.profile import Profile
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.protocols.cyberdog.vocabulary import percent, wifi_strength
from roboglot.values import dataclass
from roboglot.wire.cyberdog.chapters.system import LEGS
from roboglot.wire.cyberdog.codes import Code, SelfCheck
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.text import write

NO_SERVICE = -255  # the volume of a robot without a speaker


@dataclass(frozen=True, slots=True)
class Status:
    """Common fields of 10001 and the heartbeat."""

    motion_id: int
    task_status: int
    task_sub_status: int
    self_check: SelfCheck
    self_check_description: str
    state: int
    wired_charging: bool
    wireless_charging: bool


def status_of(context: Context) -> Status:
    """Return the current state, from the model."""
    check, errors = self_check(context.robot)
    battery = context.robot[Battery].state if Battery in context.robot else None
    return Status(
        motion_id=int(context.gaits.motion),
        task_status=int(context.tasks.state),
        task_sub_status=context.tasks.last_feedback,
        self_check=check,
        self_check_description=write(errors),
        state=int(context.gaits.state),
        wired_charging=battery is not None and battery.wired_charging,
        wireless_charging=battery is not None and battery.dock_charging,
    )


def ticks(context: Context, address: str) -> pb.Ticks:
    """Return one heartbeat; ``address``: the robot's, for the app."""
    if context.played is not None and (recorded := context.played.ticks(address)) is not None:
        return recorded
    status = status_of(context)
    return pb.Ticks(
        ip=address,
        wifi_strength=_strength(context.robot),
        battery_power=percent(context.robot[Battery].state.percentage) if Battery in context.robot else 0,
        internet=Network in context.robot and context.robot[Network].state.internet,
        sn=context.robot.description.serial,
        motion_status=pb.MotionStatus(motion_id=status.motion_id),
        task_status=pb.TaskStatus(task_status=status.task_status, task_sub_status=status.task_sub_status),
        self_check_status=pb.SelfCheckStatus(code=int(status.self_check), description=status.self_check_description),
        state_switch_status=pb.StateSwitchStatus(state=status.state, code=0),
        charging_status=pb.ChargingStatus(
            wired_charging=status.wired_charging, wireless_charging=status.wireless_charging
        ),
        audio=activated(context.robot),
    )


@TABLE.on(Code.STATUS, right=Right.SEE)
async def query_status(call: Call) -> dict[str, object]:
    """Return the states of the heartbeat."""
    status = status_of(call.context)
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


def _battery(context: Context) -> dict[str, object]:
    if Battery not in context.robot:
        return {}
    state = context.robot[Battery].state
    return {
        "capacity": round(1000.0 * state.capacity),  # mAh
        "power": percent(state.percentage),
        "voltage": round(1000.0 * state.voltage),  # mV
        "temperature": round(state.temperature),
        "is_charging": state.charging,
        "discharge_time": round((state.remaining or 0.0) / 60.0),  # min; 0 while connected to power
    }


def _wifi(context: Context) -> dict[str, object]:
    """Return the network of the simulated world, but the real address for clients."""
    if Network not in context.robot:
        return {"name": "", "ip": context.address, "mac": "", "strength": 0}
    network = context.robot[Network]
    state = network.state
    return {"name": state.ssid, "ip": context.address, "mac": state.mac, "strength": _strength(context.robot)}


def _strength(robot: Robot) -> int:
    """Return the signal strength, 0 to 100; 0 without a network."""
    return wifi_strength(robot[Network].signal) if Network in robot and robot[Network].connected else 0


def _versions(context: Context) -> dict[str, object]:
    """Return the overall version, and those of the boards ("board.module")."""
    robot = context.robot
    if Firmware not in robot:
        return {"new_version": robot.description.software_version}
    firmware = robot[Firmware]
    answer: dict[str, Any] = {"new_version": firmware.version, "nx_debs": {"sw-version": firmware.version}}
    for module, version in firmware.modules.items():
        board, dot, part = module.partition(".")
        if dot and board != NX:
            answer.setdefault(board, {})[part] = version
    return answer


def _motor_temperatures(context: Context) -> dict[str, object]:
    """Return temperatures, Celsius, four legs per joint. Real robots send text with two decimals, or a word."""
    known, real = Motors in context.robot, context.profile is not Profile.SPEC
    if real and not known:
        return dict.fromkeys(JOINTS, "unavalible")
    warm = dict(context.robot[Motors].temperatures) if known else {}

    def shown(celsius: float | None) -> object:
        if celsius is None:
            return "unkown" if real else None
        return f"{celsius:.2f}" if real else round(celsius, 2)

    return {joint: [shown(warm.get(f"{leg} {name}")) for leg in LEGS] for joint, name in JOINTS.items()}


NX = "nx"
JOINTS = {"hip": "hip", "thigh": "thigh", "crus": "knee"}
INFORMATION: Mapping[str, Callable[[Context, str], object]] = {
    "version": lambda context, _: _versions(context),
    "sn": lambda context, _: context.robot.description.serial,
    "nick_name": lambda context, _: {"default_name": DEFAULT_NAME, "current_name": nickname(context.robot)},
    "volume": lambda context, _: percent(context.robot[Speaker].volume) if Speaker in context.robot else NO_SERVICE,
    "mic_state": lambda context, _: context.voice.microphone,
    "voice_control": lambda context, _: context.voice.controlled,
    "wifi": lambda context, _: _wifi(context),
    "bat_info": lambda context, _: _battery(context),
    "motor_temper": lambda context, _: _motor_temperatures(context),
    "audio_state": lambda context, uid: activated(context.robot, uid or None),
    "device_model": lambda context, _: context.robot.description.model,
    "stand": lambda context, _: context.gaits.posture is Posture.STANDING,
    "lowpower_control": lambda context, _: Power in context.robot and context.robot[Power].automatic,
}


@TABLE.on(Code.DEVICE_INFO, right=Right.SEE)
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
    uid: str | int = "",
) -> dict[str, object]:
    """Return the requested values, and always "non-standing", as real robots do."""
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
    answer = {
        key: tell(call.context, str(uid)) for (key, tell), yes in zip(INFORMATION.items(), wanted, strict=True) if yes
    }
    return {**answer, "non-standing": call.context.gaits.posture is not Posture.STANDING}


@TABLE.on(Code.DISCONNECT_APP, right=Right.DRIVE)
async def disconnect_app(call: Call) -> str:
    """Forget the app's address: heartbeats and pushes end until the next request comes."""
    call.context.app.forget()
    return ""
