"""Signalling of the image transmission (4001): JSON of offers, answers, candidates and ends. Knows no WebRTC.

Both directions use the same forms; a message with only a ``uid`` asks the robot to end the video of that app.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum, StrEnum

import msgspec

from roboglot.values import dataclass
from roboglot.wire.cyberdog.text import Int32, NotJson, read_json

DEFAULT_UID = "default_uid"  # uid of an app that gives none
UID_MAX = 128  # characters
SDP_MAX = 65_536  # characters
CANDIDATE_MAX = 1024  # characters
STRETCH_MAX = 4.0  # largest ratio of a screen's sides


class Alignment(StrEnum):
    """Position of the picture on the screen."""

    TOP = "top"
    MIDDLE = "middle"
    BOTTOM = "bottom"


class VideoError(IntEnum):
    """``error.code`` of a push."""

    NO_CAMERA = 1001
    NO_CONNECTION = 1002


@dataclass(frozen=True, slots=True)
class Screen:
    """Screen of the app, pixels."""

    width: int
    height: int
    alignment: Alignment


@dataclass(frozen=True, slots=True)
class Description:
    """An offer (of the app) or an answer (of the robot)."""

    uid: str
    kind: str  # "offer", "answer"
    sdp: str
    screen: Screen | None = None


@dataclass(frozen=True, slots=True)
class Candidate:
    """One candidate address of the sender; empty after the last."""

    uid: str
    candidate: str
    mid: str | None
    index: int | None


@dataclass(frozen=True, slots=True)
class End:
    """End of a video: requested by the app, or (``done``) reported by the robot."""

    uid: str
    done: bool = False


@dataclass(frozen=True, slots=True)
class Failure:
    """Failure of the robot; ``code``: a VideoError if known."""

    uid: str
    code: int
    message: str


Signal = Description | Candidate | End | Failure


class _Sdp(msgspec.Struct):
    sdp: str
    type: str = ""


class _Candidate(msgspec.Struct):
    candidate: str
    sdpMid: str | None = None  # noqa: N815 - the wire's name
    sdpMLineIndex: Int32 | None = None  # noqa: N815


class _Error(msgspec.Struct):
    code: int
    msg: str = ""


class BadSignal(ValueError):
    """The message is not a valid signal."""


def read_signal(fields: Mapping[str, object]) -> Signal:
    """Return the signal in ``fields``; a description may be an object, JSON text, or bare SDP. Raises BadSignal."""
    uid = fields.get("uid") or DEFAULT_UID
    if not isinstance(uid, str) or len(uid) > UID_MAX:
        raise BadSignal(f"uid is a text of up to {UID_MAX} characters")
    try:
        for kind in ("offer", "answer"):
            if (value := fields.get(f"{kind}_sdp")) is not None:
                return Description(uid, kind, _sdp(value), _screen(fields))
        if (value := fields.get("c_sdp")) is not None:
            return _candidate(uid, value)
        if (value := fields.get("error")) is not None:
            error = msgspec.convert(value, _Error)
            return Failure(uid, error.code, error.msg)
    except (msgspec.MsgspecError, NotJson) as error:
        raise BadSignal(str(error)) from None
    return End(uid, fields.get("is_closed") is True)


def fields_of(signal: Signal) -> dict[str, object]:
    """Return the fields of a signal, for ``read_signal``."""
    match signal:
        case Description(uid, kind, sdp, screen):
            size = (
                {"height": screen.height, "width": screen.width, "alignment": str(screen.alignment)} if screen else {}
            )
            return {f"{kind}_sdp": {"type": kind, "sdp": sdp}, "uid": uid, **size}
        case Candidate(uid, candidate, mid, index):
            return {"c_sdp": {"sdpMid": mid, "sdpMLineIndex": index, "candidate": candidate}, "uid": uid}
        case Failure(uid, code, message):
            return {"error": {"code": code, "msg": message}, "uid": uid}
        case End(uid, done):
            return {"is_closed": True, "uid": uid} if done else {"uid": uid}


def _sdp(value: object) -> str:
    if isinstance(value, str) and not value.lstrip().startswith("{"):
        text = value
    else:
        text = msgspec.convert(read_json(value) if isinstance(value, str) else value, _Sdp).sdp
    if not 0 < len(text) <= SDP_MAX:
        raise BadSignal(f"an SDP has up to {SDP_MAX} characters")
    return text


def _candidate(uid: str, value: object) -> Candidate:
    found = msgspec.convert(read_json(value) if isinstance(value, str) else value, _Candidate)
    if len(found.candidate) > CANDIDATE_MAX:
        raise BadSignal(f"a candidate has up to {CANDIDATE_MAX} characters")
    return Candidate(uid, found.candidate, found.sdpMid, found.sdpMLineIndex)


def _screen(fields: Mapping[str, object]) -> Screen | None:
    """Return the screen only if all three fields are valid, as on real robots."""
    height, width, alignment = (fields.get(name) for name in ("height", "width", "alignment"))
    if not (isinstance(height, int) and isinstance(width, int) and alignment in tuple(Alignment)):
        return None
    if min(height, width) <= 0 or not 1 / STRETCH_MAX <= height / width <= STRETCH_MAX:
        return None
    return Screen(width, height, Alignment(str(alignment)))
