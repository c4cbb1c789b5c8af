"""What the program service tells whoever listens: things that happened to a task, and refusals. Plain data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from roboglot.programs.tasks import TaskOperation
from roboglot.wire.visual.codes import FeedbackState


@dataclass(frozen=True, slots=True)
class TaskReport:
    """Something happened to a task by itself. ``state`` is a FeedbackState, on block reports an ability's StateCode.

    ``block`` is ("begin" or "end", the block's id), or None.
    """

    task: str
    operation: TaskOperation
    state: int
    describe: str
    block: tuple[str, str] | None = None


Report = Callable[[TaskReport], None]


class Refusal(Exception):
    """An operation is not done; ``state`` is the number and the message the words for it."""

    def __init__(self, state: FeedbackState, message: str) -> None:
        super().__init__(message)
        self.state = state
