"""Instants at which a robot, and its base, last started; times counted from there begin again at 0."""

from __future__ import annotations

from roboglot.model.components.system.firmware import Module
from roboglot.model.errors import NotReady
from roboglot.model.events import EventStream, ModuleRestarted, Rebooted, Rebooting, ShuttingDown
from roboglot.operations import Right


class Starts:
    """Robot times of the last starts, s; 0 for those of this program. ``down``: why the robot is not up, or empty."""

    def __init__(self, events: EventStream) -> None:
        self.robot = self.base = 0.0
        self.down = ""
        events.listen(Rebooting, self._rebooting)
        events.listen(ShuttingDown, self._shutting_down)
        events.listen(Rebooted, self._rebooted)
        events.listen(ModuleRestarted, self._module_restarted)

    def check(self, right: Right | None) -> None:
        """Raise NotReady for operations that need more than ``SEE`` while the robot is not up.

        Its doors stay open a moment to send their last answers: what clients set then would be lost.
        """
        if self.down and right is not Right.SEE:
            raise NotReady(self.down)

    def _rebooting(self, _: Rebooting) -> None:
        self.down = "the robot restarts"

    def _shutting_down(self, _: ShuttingDown) -> None:
        self.down = "the robot is off"

    def _rebooted(self, event: Rebooted) -> None:
        self.down = ""
        self.robot = self.base = event.stamp

    def _module_restarted(self, event: ModuleRestarted) -> None:
        if event.module == Module.BASE:
            self.base = event.stamp
