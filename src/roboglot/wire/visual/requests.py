"""Frames from front end to robot: one JSON object each (0.2.1.1), checked field by field in the manual's order.

Strict JSON, except for raw line breaks inside strings, which the manual's own examples have. Knows no task's state.
"""

from __future__ import annotations

import json
import re
from enum import StrEnum
from typing import NoReturn

from roboglot.task_conditions import BadCondition, parse_cycle, parse_interface, parse_moment
from roboglot.values import dataclass
from roboglot.wire.visual.codes import FeedbackState

FRAME_MAX = 4_000_000  # characters
ID_MAX = 128
TARGETS_MAX = 1000
DESCRIBE_MAX = 10_000
STYLE_MAX = 2_000_000  # Blockly workspaces are long
BODY_MAX = 256 * 1024
_TARGET = re.compile(r"[0-9A-Za-z_]+")
_SURROGATE = re.compile("[\ud800-\udfff]")
DEBUG = "debug"


class FrameSubject(StrEnum):
    """Subject of a frame."""

    TASK = "task"
    MODULE = "module"
    AI = "AI"
    SLAM = "SLAM"


OPERATIONS: dict[FrameSubject, frozenset[str]] = {
    FrameSubject.TASK: frozenset({"save", "delete", "inquiry", "debug", "run", "shutdown", "suspend", "recover"}),
    FrameSubject.MODULE: frozenset({"save", "delete", "inquiry"}),
    FrameSubject.AI: frozenset({"inquiry"}),
    FrameSubject.SLAM: frozenset({"inquiry"}),
}
MODES: dict[FrameSubject, frozenset[str]] = {
    FrameSubject.TASK: frozenset({"single", "cycle"}),
    FrameSubject.MODULE: frozenset({"common", "sequence"}),
    FrameSubject.AI: frozenset({"all", "personnel", "face", "voiceprint", "training_words"}),
    FrameSubject.SLAM: frozenset({"map", "preset"}),
}


@dataclass(frozen=True, slots=True)
class Request:
    """A legal frame. Fields that its operation does not use are empty."""

    kind: FrameSubject
    id: str
    operate: str
    targets: tuple[str, ...]
    describe: str = ""
    style: str = ""
    mode: str = ""
    condition: str = ""
    body: str = ""


class BadFrame(ValueError):
    """Error in a frame, with the fields that the feedback needs (empty if unreadable)."""

    def __init__(self, state: FeedbackState, message: str, fields: dict[str, object]) -> None:
        super().__init__(message)
        self.state = state
        self.kind = _text_of(fields.get("type"))
        self.id = _text_of(fields.get("id"))
        self.operate = _text_of(fields.get("operate"))
        targets = fields.get("target_id")
        self.target = _text_of(targets[0]) if isinstance(targets, list) and targets else ""


def stops(text: str) -> bool:
    """Return whether a frame suspends or ends tasks."""
    try:
        request = parse_request(text)
    except BadFrame:
        return False
    return request.operate in ("suspend", "shutdown")


def parse_request(text: str) -> Request:
    """Return a checked frame. Raises BadFrame with the code of the first bad field."""
    fields = _decode(text)
    check = _Checker(fields)
    kind = check.kind()
    frame_id = check.text("id", FeedbackState.BAD_ID, ID_MAX) or check.refuse(FeedbackState.BAD_ID, "id is missing")
    operate = check.operate(kind)
    targets = check.targets(kind, operate)
    saving = operate in ("save", "debug")
    describe = check.text("describe", FeedbackState.BAD_DESCRIBE, DESCRIBE_MAX)
    if '"""' in describe:
        check.refuse(FeedbackState.BAD_DESCRIBE, "describe contains three double quotes in a row")
    style = check.text("style", FeedbackState.BAD_STYLE, STYLE_MAX)
    mode = check.mode(kind, operate)
    condition = check.condition(operate, mode)
    body = check.text("body", FeedbackState.BAD_BODY, BODY_MAX)
    if saving and not body.strip():
        check.refuse(FeedbackState.BAD_BODY, "body is missing")
    if not saving:
        describe = style = body = ""
    return Request(kind, frame_id, operate, targets, describe, style, mode, condition, body)


def _decode(text: str) -> dict[str, object]:
    if len(text) > FRAME_MAX:
        raise BadFrame(FeedbackState.NOT_JSON, f"a frame has at most {FRAME_MAX} characters", {})
    try:
        fields = json.loads(text, strict=False, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise BadFrame(FeedbackState.NOT_JSON, f"not JSON: {_fault(error)}", {}) from None
    if not isinstance(fields, dict):
        raise BadFrame(FeedbackState.NOT_JSON, "not a JSON object", {})
    return fields


def _fault(error: ValueError | RecursionError) -> str:
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, json.JSONDecodeError):
        return f"line {error.lineno}, column {error.colno}: {error.msg}"
    return "a number is too long" if "digits" in str(error) else str(error)


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not JSON")


class _Checker:
    """Reads the fields of one frame; refuses bad ones with their codes."""

    __slots__ = ("_fields",)

    def __init__(self, fields: dict[str, object]) -> None:
        self._fields = fields

    def refuse(self, state: FeedbackState, message: str) -> NoReturn:
        raise BadFrame(state, message, self._fields)

    def text(self, name: str, state: FeedbackState, limit: int) -> str:
        """Return a string of at most ``limit`` characters; empty if missing."""
        value = self._fields.get(name, "")
        if not isinstance(value, str):
            self.refuse(state, f"{name} must be a string")
        if len(value) > limit:
            self.refuse(state, f"{name} is longer than {limit} characters")
        if _SURROGATE.search(value) or "\0" in value:
            self.refuse(state, f"{name} contains invalid characters")
        return value

    def kind(self) -> FrameSubject:
        value = self.text("type", FeedbackState.BAD_TYPE, ID_MAX)
        try:
            return FrameSubject(value)
        except ValueError:
            self.refuse(FeedbackState.BAD_TYPE, "type must be task, module, AI or SLAM")

    def operate(self, kind: FrameSubject) -> str:
        value = self.text("operate", FeedbackState.BAD_OPERATE, ID_MAX)
        if not value and kind in (FrameSubject.AI, FrameSubject.SLAM):
            value = "inquiry"
        if value == "add" and kind is FrameSubject.MODULE:  # the name in the manual's module chapter
            value = "save"
        if value not in OPERATIONS[kind]:
            self.refuse(
                FeedbackState.BAD_OPERATE, f"operate of a {kind} is one of {', '.join(sorted(OPERATIONS[kind]))}"
            )
        return value

    def targets(self, kind: FrameSubject, operate: str) -> tuple[str, ...]:
        state = FeedbackState.BAD_TARGET_ID
        value = self._fields.get("target_id")
        if not isinstance(value, list) or len(value) > TARGETS_MAX:
            self.refuse(state, f"target_id must be an array of at most {TARGETS_MAX} ids")
        stored = kind in (FrameSubject.TASK, FrameSubject.MODULE)  # people, maps and points have names instead of ids
        for target in value:
            if not isinstance(target, str) or not _text_of(target):
                self.refuse(state, f"target_id holds strings of 1 to {ID_MAX} characters")
            if stored and not _TARGET.fullmatch(target):
                self.refuse(state, "an id in target_id has letters, digits and _ only")
        if not value and operate != "inquiry":
            self.refuse(state, f"target_id is empty: nothing to {operate}")
        if operate == DEBUG and value[0] != DEBUG:
            self.refuse(state, 'target_id of debug is ["debug"]')
        if operate == "save" and value[0] == DEBUG:
            self.refuse(state, "the id debug is for the operation debug")
        return tuple(dict.fromkeys(value))

    def mode(self, kind: FrameSubject, operate: str) -> str:
        state = FeedbackState.BAD_MODE
        value = self.text("mode", state, ID_MAX)
        if operate == DEBUG and value != "single":
            self.refuse(state, "mode of debug is single")
        needed = operate == "save" or kind in (FrameSubject.AI, FrameSubject.SLAM)
        if not needed and operate not in ("run", DEBUG):
            return ""
        if value not in MODES[kind] and (needed or value):
            self.refuse(state, f"mode of a {kind} is one of {', '.join(sorted(MODES[kind]))}")
        return value

    def condition(self, operate: str, mode: str) -> str:
        state = FeedbackState.BAD_CONDITION
        value = self.text("condition", state, DESCRIBE_MAX)
        if operate == DEBUG and value != "now":
            self.refuse(state, "condition of debug is now")
        if operate not in ("save", "run", DEBUG):
            return ""
        # Without a mode in run, the stored one decides the form of the condition, which is unknown here.
        if mode:
            try:
                CONDITIONS[mode](value)
            except BadCondition as error:
                self.refuse(state, f"condition: {error}")
        return value


CONDITIONS = {"single": parse_moment, "cycle": parse_cycle, "common": parse_interface, "sequence": parse_interface}


def _text_of(value: object) -> str:
    """Return the part of an unchecked value that may be echoed."""
    return value if isinstance(value, str) and len(value) <= ID_MAX and not _SURROGATE.search(value) else ""
