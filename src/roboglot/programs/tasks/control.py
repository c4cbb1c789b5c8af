"""Reports motions refused to a program because another client controls the robot. Knows no process and no task."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.events import ControlRefused
from roboglot.model.robot import Robot


class ControlWatch:
    """Listens from ``start`` to ``close`` for refusals of ``client``; ``write`` gets a line for each new reason."""

    def __init__(self, robot: Robot, client: str, write: Callable[[str], None]) -> None:
        self._robot, self._client, self._write = robot, client, write
        self._count = 0
        self._reason = ""
        self._leave: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Start counting."""
        self._leave = self._robot.events.listen(ControlRefused, self._refused)

    def close(self) -> None:
        """Stop counting."""
        self._leave()

    @property
    def summary(self) -> str:
        """Number of motions refused or ended, and the last reason; empty without any."""
        if not self._count:
            return ""
        if self._count == 1:
            words = f"1 motion was not carried out: {self._reason}"
        else:
            words = f"{self._count} motions were not carried out: {self._reason}"
        return words

    def _refused(self, event: ControlRefused) -> None:
        if event.client != self._client:
            return
        self._count += 1
        if event.reason != self._reason:
            self._reason = event.reason
            words = f"{event.doing} was not carried out: {event.reason}"
            self._write(words)
