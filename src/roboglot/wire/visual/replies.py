"""Robot to front end: feedback, progress and response frames (0.2.1.2). Formats; decides nothing."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

DESCRIBE_MAX = 4000  # characters of describe in a frame that goes out


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
    """A feedback frame (0.2.1.2.2.1); with ``block`` = ("begin" or "end", its id) a progress frame (0.2.1.2.2.2)."""
    frame: dict[str, object] = {
        "feedback": {
            "type": kind,
            "id": id,
            "target_id": target,
            "operate": operate,
            "state": state,
            # Programs can raise errors whose text no UTF-8 can hold.
            "describe": describe[:DESCRIBE_MAX].encode("utf-8", "replace").decode(),
        }
    }
    if block is not None:
        frame["block"] = {"type": block[0], "id": block[1]}
    return json.dumps(frame, ensure_ascii=False)


def response(*, kind: str, id: str, items: Sequence[Mapping[str, object]]) -> str:
    """The answer to a legal inquiry (0.2.1.2.2.3 and following)."""
    return json.dumps({"response": {"type": kind, "id": id, "list": items}}, ensure_ascii=False)
