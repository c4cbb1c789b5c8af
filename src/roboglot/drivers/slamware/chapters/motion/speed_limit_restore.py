"""Restores the robot's own speed limit after slower driving; keeps it on disk so that a crash does not lose it."""

from __future__ import annotations

import logging
from typing import Final

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot
from roboglot.wire.slamware.chapters.system.devices import Parameter

log = logging.getLogger(__name__)
PARAMETER: Final = "base.max_moving_speed"
SETTING = "slamware_driver.owed_speed"  # the setting: the robot's URL and its limit, m/s


class SpeedLimitRestore:
    """Holds ``speed``, the limit to restore (m/s); None while the robot has its own limit."""

    def __init__(self, robot: Robot, client: SlamwareClient, link: Link) -> None:
        self._robot, self._client, self._link = robot, client, link
        self.speed: float | None = None

    async def remember(self, speed: float) -> None:
        """Store the limit before its first change; return when it is on disk."""
        if self.speed is None:
            self.speed = speed
            await self._store([self._link.address, speed])

    def recall(self) -> None:
        """Load the limit that an earlier run of the program left changed."""
        stored = self._robot[Settings].get(SETTING, None) if Settings in self._robot else None
        match stored:
            case [self._link.address, float(speed)] if self.speed is None:
                self.speed = speed

    async def restore(self) -> None:
        """Restore the limit. Raises ClientError without a link; the limit then stays stored."""
        if self.speed is None:
            return
        try:
            await self._client.set_system_parameter(Parameter(PARAMETER, f"{self.speed:.6f}"))
        except SlamwareRefused as refused:
            log.warning("%s does not take its own speed limit back: %s", self._link.name, refused)
        self.speed = None
        await self._store(None)

    async def _store(self, what: list[str | float] | None) -> None:
        if Settings in self._robot:
            await self._robot[Settings].put(SETTING, what)
