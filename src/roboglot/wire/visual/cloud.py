"""Messages between robots and their cloud (0.2.1.3): frames to the cloud, answers with a code back. Pure text."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import field
from enum import StrEnum
from typing import Any

from roboglot.values import dataclass

KINDS, RECORD = ("task", "module"), "record"  # programs of an account; history of its robots
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
    """The answer does not conform to 0.2.1.3."""


@dataclass(frozen=True, slots=True)
class CloudAnswer:
    """Answer of the cloud; ``items``: unchecked frames, or parts of frames."""

    code: CloudCode
    message: str
    request: str
    items: list[dict[str, Any]] = field(default_factory=list)


def format_answer(
    code: CloudCode, message: str, request: str, items: Sequence[Mapping[str, object]] | None = None
) -> bytes:
    """Return the bytes of an answer; with ``data`` only if ``items`` are given."""
    fields: dict[str, object] = {"code": str(code), "message": message, "request_id": request}
    if items is not None:
        fields["data"] = items
    return json.dumps(fields, ensure_ascii=False).encode("utf-8", "replace")


def parse_answer(body: bytes) -> CloudAnswer:
    """Return an answer from its bytes. Raises BadCloudAnswer."""
    try:
        fields = json.loads(body)
        items = fields.get("data") or []
        answer = CloudAnswer(CloudCode(str(fields["code"])), str(fields["message"]), str(fields["request_id"]), items)
    except (ValueError, KeyError, AttributeError, RecursionError) as error:
        raise BadCloudAnswer(f"no answer of a cloud: {error}"[:200]) from None
    if not isinstance(items, list) or len(items) > ITEMS_MAX or not all(isinstance(item, dict) for item in items):
        raise BadCloudAnswer("data is not a list of programs")
    return answer


def inquiry(kind: str, id: str, known: Sequence[str]) -> str:
    """Return the robot's request for programs that it lacks; ``known``: ids of those that it has."""
    empty = dict.fromkeys(("describe", "style", "mode", "condition", "body"), "")
    return json.dumps({"type": kind, "id": id, "operate": "inquiry", "target_id": list(known)} | empty)


def save_frame(item: Mapping[str, object], kind: str) -> str:
    """Return a front end's frame for saving an item; the program's id is its first target or its ``id``."""
    targets = item.get("target_id")
    id = targets[0] if isinstance(targets, list) and targets else item.get("id")
    texts = {name: item.get(name, "") for name in ("describe", "style", "mode", "condition", "body")}
    return json.dumps({"type": kind, "id": f"cloud_{id}", "operate": "save", "target_id": [id]} | texts)
