"""Chapter "delivery": the operator's settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import msgspec

from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.delivery import Delivery, Policy, WorkMode
from roboglot.model.components.motion.base import Base
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import DeliveryNews, DeliveryReported
from roboglot.model.geometry import wrap_angle
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.delivery.cargo import all_cargos
from roboglot.protocols.slamware.chapters.delivery.voice import LANGUAGE, language_of
from roboglot.protocols.slamware.chapters.motion.moves import PRECISE, tolerance_of
from roboglot.protocols.slamware.chapters.system.system import device_id, software_version
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import TRACKS
from roboglot.validation import why_invalid
from roboglot.wire.slamware.chapters.delivery import (
    AdminPassword,
    BatteryLevels,
    Configuration,
    DeliverySettings,
    Hours,
    Language,
    LineSpeed,
    OperationReply,
    Password,
    TimeoutChange,
    Timeouts,
    VoicePackages,
    WorkingTime,
    WorkModeEntry,
    WrappedSettings,
)
from roboglot.wire.slamware.chapters.motion import MoveFlag, MoveOptions

API = "/api/delivery/v1"
PASSWORD = "slamware.delivery_password"
RATIO_MIN = 0.1
DONE = OperationReply(result=True)


async def _set(context: Context, edit: Callable[[Policy], Policy]) -> OperationReply:
    await context.robot[Delivery].change_policy(edit)
    return DONE


@TABLE.on(f"GET {API}/admin/password", right=Right.ADMIN, needs=(Settings,))
def get_password(context: Context) -> AdminPassword:
    """Return the password of the settings on the robot's screen; it never expires."""
    return AdminPassword(msgspec.convert(context.robot[Settings].get(PASSWORD, {"enable": False}), Password))


@TABLE.on(f"PUT {API}/admin/password", right=Right.ADMIN, needs=(Settings,))
async def set_password(context: Context, body: Password | None = None) -> OperationReply:
    """Set or remove the password of the robot's screen; the API itself is open."""
    new = body or Password(enable=False)
    if new.enable and not new.password:
        return OperationReply(result=False, reason="a password is needed")
    await context.robot[Settings].put(PASSWORD, msgspec.to_builtins(new))
    return DONE


@TABLE.on(f"GET {API}/admin/mode", right=Right.SEE, needs=(Delivery,))
def get_work_mode(context: Context) -> WorkModeEntry:
    """Return the work mode: the tasks that may be created at the robot."""
    return msgspec.convert({"work_mode": context.robot[Delivery].policy.work_mode.value.upper()}, WorkModeEntry)


@TABLE.on(f"PUT {API}/admin/mode", right=Right.EDIT, needs=(Delivery,))
async def set_work_mode(context: Context, body: WorkModeEntry) -> OperationReply:
    """Set the tasks that may be created at the robot: DISPATCH none, RECYCLE collecting dishes, MANUAL any."""
    return await _set(context, lambda policy: replace(policy, work_mode=WorkMode(body.work_mode.lower())))


@TABLE.on(f"GET {API}/admin/language", right=Right.SEE, needs=(Settings,))
def get_language(context: Context) -> Language:
    """Return the language; Chinese by default."""
    return Language(language_of(context.robot))


@TABLE.on(f"PUT {API}/admin/language", right=Right.EDIT, needs=(Settings,))
async def set_language(context: Context, body: Language) -> OperationReply:
    """Set the robot's spoken language, Chinese or English."""
    await context.robot[Settings].put(LANGUAGE, body.language)
    now, robot = context.robot.clock.time(), context.robot
    robot.events.publish(DeliveryReported(stamp=now, news=DeliveryNews.SETTINGS_CHANGED))
    return DONE


@TABLE.on(f"GET {API}/admin/working_time", right=Right.SEE, needs=(Delivery,))
def get_working_time(context: Context) -> WorkingTime:
    """Return the working hours, UTC; no hours: always."""
    policy = context.robot[Delivery].policy
    return WorkingTime([Hours(_clock(a), _clock(b)) for a, b in policy.hours], list(policy.rest_days))


@TABLE.on(f"PUT {API}/admin/working_time", right=Right.EDIT, needs=(Delivery,))
async def set_working_time(context: Context, body: WorkingTime) -> OperationReply:
    """Set the working hours (UTC), outside of which the robot rests on its dock and tasks wait."""
    hours = tuple((_seconds(entry.start_time), _seconds(entry.end_time)) for entry in body.hours)
    rest_days = tuple(sorted(set(body.restdays)))
    return await _set(context, lambda policy: replace(policy, hours=hours, rest_days=rest_days))


def _seconds(clock: str) -> int:
    hours, minutes, seconds = map(int, clock.split(":"))
    return hours * 3600 + minutes * 60 + seconds


def _clock(seconds: int) -> str:
    return f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}"


@TABLE.on(f"GET {API}/admin/move_options", right=Right.SEE, needs=(Delivery,))
def get_move_options(context: Context) -> MoveOptions:
    """Return the settings for driving in tasks."""
    return _effective(msgspec.convert(_stored(context.robot[Delivery].policy), MoveOptions))


@TABLE.on(f"PUT {API}/admin/move_options", right=Right.EDIT, needs=(Delivery,))
async def set_move_options(context: Context, body: dict[str, object] | None = None) -> OperationReply:
    """Change the given settings, or reset all by an empty body; applies from the next drive."""
    return await _set(context, lambda policy: _with_move_options(policy, body))


def _with_move_options(policy: Policy, body: dict[str, object] | None) -> Policy:
    """Return the policy with the given settings, or with none. Raises InvalidGoal."""
    words = {**_stored(policy), **body} if body else {}
    words = {name: value for name, value in words.items() if name in MoveOptions.__struct_fields__}
    try:
        how = _effective(msgspec.convert(words, MoveOptions))
    except msgspec.ValidationError as error:
        raise InvalidGoal(why_invalid(error, wanted=MoveOptions)) from None
    return replace(
        policy,
        words=words,
        tracks=TRACKS[how.mode],
        yaw=wrap_angle(how.yaw) if how.has("with_yaw") and how.yaw is not None else None,
        retries=how.fail_retry_count or 0 if how.has("fail_retry_count") else 0,
        speed_ratio=min(max(how.speed_ratio, RATIO_MIN), 1.0) if how.speed_ratio else 1.0,
        tolerance=tolerance_of(how) or PRECISE,
        waits=how.has("find_path_ignoring_dynamic_obstacles"),
        directed=how.has("with_directed_virtual_track"),
    )


def _stored(policy: Policy) -> dict[str, object]:
    """Return the stored settings, without the unlisted flags that earlier versions of this program accepted."""
    words = dict(policy.words)
    if isinstance(flags := words.get("flags"), list):
        words["flags"] = [flag for flag in flags if flag in get_args(MoveFlag)]
    return words


def _effective(how: MoveOptions) -> MoveOptions:
    """Return the settings normalised: a list for 0, null or [null] as flags, and 0 for unset values."""
    flags: list[MoveFlag | None] = [flag for flag in how.flags if flag] if isinstance(how.flags, list) else []
    return MoveOptions(
        how.mode,
        flags,
        how.yaw or 0.0,
        how.acceptable_precision or 0.0,
        how.fail_retry_count or 0,
        how.speed_ratio or 0.0,
    )


@TABLE.on(f"GET {API}/admin/line_speed", right=Right.SEE, needs=(Base, Delivery))
def get_line_speed(context: Context) -> LineSpeed:
    """Return the speeds on the way to people and back, m/s: those set, at most the robot's top speed."""
    policy, most = context.robot[Delivery].policy, context.robot[Base].limits.twist.x
    there, back = (
        most if speed is None else min(speed, most) for speed in (policy.delivery_speed, policy.return_speed)
    )
    return LineSpeed(there, back)


@TABLE.on(f"PUT {API}/admin/line_speed", right=Right.EDIT, needs=(Delivery,))
async def set_line_speed(context: Context, body: LineSpeed) -> None:
    """Set the speeds from the next drive on, at most the robot's top speed."""

    def edit(policy: Policy) -> Policy:
        there = policy.delivery_speed if body.delivery_speed is None else body.delivery_speed
        back = policy.return_speed if body.return_speed is None else body.return_speed
        return replace(policy, delivery_speed=there, return_speed=back)

    await _set(context, edit)


@TABLE.on(f"GET {API}/configurations", right=Right.SEE, needs=(Settings,))
def get_configurations(context: Context) -> Configuration:
    """Return the machine's configuration; it does not relocalize when parked."""
    cargos = all_cargos(context.robot) if Cargo in context.robot else []
    return Configuration(
        device_id(context.robot), software_version(context.robot), context.cloud.managed, False, cargos
    )


@TABLE.on(f"GET {API}/settings", right=Right.SEE, needs=(Delivery,))
def get_delivery_settings(context: Context) -> WrappedSettings:
    """Return battery levels (percent) and time-outs (s)."""
    policy = context.robot[Delivery].policy
    levels = BatteryLevels(policy.level_off, policy.level_home, policy.level_no_cloud, policy.level_no_takeout)
    timeouts = Timeouts(
        takeout_pickup_timeout=round(policy.pickup_seconds),
        takeout_open_door_timeout=round(policy.door_seconds),
        collect_pickup_timeout=round(policy.collect_seconds),
        brake_released_timeout=round(policy.stopped_seconds),
        food_pickup_timeout=round(policy.food_seconds),
    )
    return WrappedSettings(DeliverySettings(levels, timeouts))


@TABLE.on(f"PUT {API}/settings/timeout", right=Right.EDIT, needs=(Delivery,))
async def set_timeout_settings(context: Context, body: TimeoutChange) -> None:
    """Set the time that the robot waits for a guest to take the food, s."""
    await _set(context, lambda policy: replace(policy, food_seconds=float(body.food_pickup_timeout)))


@TABLE.on(f"GET {API}/voice_resources", right=Right.SEE, needs=(Settings,))
def get_voice_resources(context: Context) -> VoicePackages:
    """Return the cloud's voice packages; ``result`` false without a cloud, or out of reach."""
    if not context.cloud.reached:
        why = "the cloud is out of reach" if context.cloud.managed else "no cloud manages this robot"
        return VoicePackages(result=False, msg=why, data=[])
    return VoicePackages(result=True, msg="", data=context.cloud.voices())
