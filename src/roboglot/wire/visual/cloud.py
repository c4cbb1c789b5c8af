"""Messages between robots and their cloud (0.2.1.3): frames one way, answers with a code the other. Pure text."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

KINDS, RECORD = ("task", "module"), "record"  # an account's programs; the history of its robots
ITEMS_MAX = 20_000  # programs per answer
ANSWER_MAX = 64 * 1024 * 1024  # bytes
ROBOT_HEADER = "x-robot"  # identifies the account's robot


class CloudCode(StrEnum):
    """Result of a request; texts of the manual."""

    OK = "200"
    TIMED_OUT = "400"
    UNAUTHORISED = "401"
    REFUSED = "403"
    NOT_FOUND = "404"
    NO_SUCH_METHOD = "405"
    BROKEN = "500"
    MISSING = "10001"


class BadCloudAnswer(ValueError):
    """Message that does not conform to 0.2.1.3."""


@dataclass(frozen=True, slots=True)
class CloudAnswer:
    """``items`` are frames, or parts of frames, as they came."""

    code: CloudCode
    message: str
    request: str
    items: list[dict[str, Any]] = field(default_factory=list)


def format_answer(
    code: CloudCode, message: str, request: str, items: Sequence[Mapping[str, object]] | None = None
) -> bytes:
    """The cloud's end; ``data`` is there only where something was asked for."""
    fields: dict[str, object] = {"code": str(code), "message": message, "request_id": request}
    if items is not None:
        fields["data"] = items
    return json.dumps(fields, ensure_ascii=False).encode("utf-8", "replace")


def parse_answer(body: bytes) -> CloudAnswer:
    """The robot's end. Raises BadCloudAnswer."""
    try:
        fields = json.loads(body)
        items = fields.get("data") or []
        answer = CloudAnswer(CloudCode(str(fields["code"])), str(fields["message"]), str(fields["request_id"]), items)
    except (ValueError, KeyError, AttributeError, RecursionError) as error:
        raise BadCloudAnswer(f"no answer of a cloud: {error}"[:200]) from None
    if not isinstance(items, list) or len(items) > ITEMS_MAX or not all(isinstance(item, dict) for item in items):
        raise BadCloudAnswer("data is no list of programs")
    return answer


def inquiry(kind: str, id: str, known: Sequence[str]) -> str:
    """The robot asks for what it does not have yet; ``known``: all that it has."""
    empty = dict.fromkeys(("describe", "style", "mode", "condition", "body"), "")
    return json.dumps({"type": kind, "id": id, "operate": "inquiry", "target_id": list(known)} | empty)


def save_frame(item: Mapping[str, object], kind: str) -> str:
    """The frame with which a front end would save an item; its id is the program's (or the first of its targets)."""
    targets = item.get("target_id")
    id = targets[0] if isinstance(targets, list) and targets else item.get("id")
    texts = {name: item.get(name, "") for name in ("describe", "style", "mode", "condition", "body")}
    return json.dumps({"type": kind, "id": f"cloud_{id}", "operate": "save", "target_id": [id]} | texts)
