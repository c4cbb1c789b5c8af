"""Common parts of results: states, points, headers (4.2). The groups' files make whole results."""

from __future__ import annotations

import math
from enum import IntEnum

from roboglot.model.geometry import Orientation, Vector3
from roboglot.programs.worker.values import Record

SHORT_MAX = 300


class StateCode(IntEnum):
    """Result of an ability's last call (4.2, StateCode); the shipped firmware's 79xx numbers are not used."""

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
    """Return a State."""
    return Record("State", {"code": int(code), "describe": describe})


def refusal(value: object) -> str:
    """Return the words of a failed State, alone or in a function's answer; "" for none."""
    found = value if isinstance(value, Record) else None
    if found is not None and found.type != "State":
        found = found.fields.get("state")
    if not isinstance(found, Record) or found.fields.get("code", 0) == StateCode.SUCCESS:
        return ""
    return str(found.fields.get("describe") or f"code {found.fields['code']}")


def in_short(value: object, depth: int = 3) -> str:
    """Return a function's result as readable text of at most ``SHORT_MAX`` characters, with long lists cut."""
    match value:
        case Record(fields=fields):
            inner = ", ".join(f"{name} {in_short(item, depth - 1)}" for name, item in list(fields.items())[:12])
            text = f"({inner})" if depth else "…"
        case float():
            text = f"{value:.4g}"
        case list() | tuple():
            inner = ", ".join(in_short(item, depth - 1) for item in value[:6])
            text = f"[{inner}{', …' if len(value) > 6 else ''}]" if depth else "…"
        case dict():
            pairs = list(value.items())[:6]
            text = f"{{{', '.join(f'{key}: {in_short(item, depth - 1)}' for key, item in pairs)}}}" if depth else "…"
        case _:
            text = str(value)
    return text if len(text) <= SHORT_MAX else text[: SHORT_MAX - 1] + "…"


def point(x: float, y: float, z: float = 0.0) -> Record:
    """Return a Point, m."""
    return Record("Point", {"x": x, "y": y, "z": z})


def vector(value: Vector3) -> Record:
    """Return a Vector3, in the same unit."""
    return Record("Vector3", {"x": value.x, "y": value.y, "z": value.z})


def header(epoch: float, frame: str) -> Record:
    """Return a Header: Unix time in s, and the frame of the values."""
    nanoseconds = round(epoch * 1e9)
    stamp = Record("Time", {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9})
    return Record("Header", {"stamp": stamp, "frame_id": frame})


def quaternion(attitude: Orientation) -> Record:
    """Return a Quaternion of roll, pitch, yaw in rad (turned about the fixed axes in this order)."""
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
