"""Instants at which a robot, and its base, last started: times that count from there begin anew."""

from __future__ import annotations

from roboglot.model.components.system.firmware import Module
from roboglot.model.events import EventStream, ModuleRestarted, Rebooted


class Starts:
    """Robot times of the last starts, s; 0 for those of this program."""

    def __init__(self, events: EventStream) -> None:
        self.robot = self.base = 0.0
        events.listen(Rebooted, self._rebooted)
        events.listen(ModuleRestarted, self._module_restarted)

    def _rebooted(self, event: Rebooted) -> None:
        self.robot = self.base = event.stamp

    def _module_restarted(self, event: ModuleRestarted) -> None:
        if event.module == Module.BASE:
            self.base = event.stamp
