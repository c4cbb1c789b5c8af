"""Formats of frames from robot to front end: feedback, progress and response (0.2.1.2)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from roboglot.wire.visual.codes import FeedbackState

DESCRIBE_MAX = 4000  # characters of describe in an outgoing frame
UTF8_MAX = 4  # bytes per character
PART = 64  # bytes of the fields part and parts, with a margin


def feedback(
    *,
    kind: str,
    id: str,
    target: str,
    operate: str,
    state: int,
    describe: str,
    block: tuple[str, str] | None = None,
) -> str:
    """Return a feedback frame (0.2.1.2.2.1), or with ``block`` ("begin" or "end", id) a progress frame (.2.2)."""
    frame: dict[str, object] = {
        "feedback": {
            "type": kind,
            "id": id,
            "target_id": target,
            "operate": operate,
            "state": state,
            # Programs can raise errors whose text UTF-8 cannot encode.
            "describe": describe[:DESCRIBE_MAX].encode("utf-8", "replace").decode(),
        }
    }
    if block is not None:
        frame["block"] = {"type": block[0], "id": block[1]}
    return json.dumps(frame, ensure_ascii=False)


def responses(*, kind: str, id: str, items: Sequence[Mapping[str, object]], longest: int = 0) -> list[str]:
    """Return the answer to a legal inquiry (0.2.1.2.2.3 and following), in parts of at most ``longest`` bytes.

    Each part has its number and the number of parts (``part``, ``parts``). An item that is too long by itself is
    refused by a feedback with state 29. ``longest`` 0: no limit.
    """
    encoded = [json.dumps(item, ensure_ascii=False) for item in items]
    around = len(_response(kind, id, []).encode()) + PART
    if not longest or around + sum(map(len, encoded)) * UTF8_MAX + 2 * len(encoded) <= longest:
        return [_response(kind, id, encoded)]  # the usual case, without measuring
    sizes = [len(text.encode("utf-8", "replace")) + 2 for text in encoded]
    parts: list[list[str]] = [[]]
    refused, room = [], longest - around
    for item, text, size in zip(items, encoded, sizes, strict=True):
        if size > longest - around:
            refused.append(_too_long(kind, id, str(item.get("id", "")), size, longest))
            continue
        if size > room:
            parts.append([])
            room = longest - around
        parts[-1].append(text)
        room -= size
    if len(parts) == 1:
        return [_response(kind, id, parts[0]), *refused]
    return [_response(kind, id, part, (n, len(parts))) for n, part in enumerate(parts, 1)] + refused


def _response(kind: str, id: str, encoded: Sequence[str], part: tuple[int, int] | None = None) -> str:
    head = json.dumps({"type": kind, "id": id}, ensure_ascii=False)[:-1]
    place = f', "part": {part[0]}, "parts": {part[1]}' if part else ""
    return f'{{"response": {head}, "list": [{", ".join(encoded)}]{place}}}}}'


def _too_long(kind: str, id: str, target: str, size: int, longest: int) -> str:
    words = f"{target} is left out of the list: it has {size} bytes, and a message has at most {longest}"
    state = FeedbackState.OTHER
    return feedback(kind=kind, id=id, target=target, operate="inquiry", state=state, describe=words)
