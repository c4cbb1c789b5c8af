"""Last operation of each cargo box, by any client. Knows no HTTP."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.actions import Action
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.events import ActionChanged
from roboglot.model.robot import Robot

OPEN, CLOSE = "open box", "close box"  # the cargo component's names of its actions


class BoxLog:
    """Listens to the actions of cargo boxes."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._last: dict[int, Action] = {}
        self._end: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Start listening, if there are boxes."""
        if Cargo in self._robot:
            self._end = self._robot.events.listen(ActionChanged, self._changed)

    def close(self) -> None:
        """Stop listening."""
        self._end()

    def last(self, box: int) -> Action | None:
        """Return the last opening or closing of a box."""
        return self._last.get(box)

    def _changed(self, event: ActionChanged) -> None:
        action = event.action
        if action.name in (OPEN, CLOSE) and isinstance(action.goal, int):
            known = self._last.get(action.goal)
            if known is None or known.id <= action.id:
                self._last[action.goal] = action
