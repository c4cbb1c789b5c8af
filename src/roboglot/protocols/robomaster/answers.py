"""Answers of this door: results of handlers, and the bytes and reasons made of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from roboglot.values import dataclass
from roboglot.wire.robomaster.replies import Number

Why = Callable[[], str]
Result = str | Sequence[Number | str] | None  # of a handler: a Reply or free text, values, or None for a plain "ok"


@dataclass(frozen=True, slots=True)
class Answer:
    """Bytes for the client and, of a refusal, the reason in plain words for the log.

    ``explain`` is called only when a listener needs it: the search for the intended command is slow. ``warn`` returns a
    warning about a command that was carried out.
    """

    reply: bytes
    explain: Why | None = None
    warn: Why | None = None

    @property
    def why(self) -> str:
        """Reason of a refusal; empty on success."""
        return self.explain() if self.explain else ""


FastPath = Callable[[], bytes | Answer | None]
"""Answer to a repeated line: bytes, a refusal, or None: nothing was done, and the line must be parsed."""
