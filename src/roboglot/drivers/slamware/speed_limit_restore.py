"""The robot's own speed limit while we drive it slower: kept on disk, so that it is put back even after a crash."""

from __future__ import annotations

import contextlib

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot
from roboglot.wire.slamware.devices import Parameter

PARAMETER = "base.max_moving_speed"
KEPT = "slamware_driver.owed_speed"  # the setting: whose limit (the robot's URL), and what it was, m/s


class SpeedLimitRestore:
    """``speed``: what is to be put back; None: the robot has its own limit."""

    def __init__(self, robot: Robot, client: SlamwareClient, link: Link) -> None:
        self._robot, self._client, self._link = robot, client, link
        self.speed: float | None = None

    async def remember(self, speed: float) -> None:
        """Before the limit is changed for the first time. Returns when that is safe on disk."""
        if self.speed is None:
            self.speed = speed
            await self._keep([self._link.address, speed])

    def recall(self) -> None:
        """At a connection: what another run of this program left behind."""
        kept = self._robot[Settings].get(KEPT, None) if Settings in self._robot else None
        match kept:
            case [self._link.address, float(speed)] if self.speed is None:
                self.speed = speed

    async def put_back(self) -> None:
        """Raises ClientError if the robot cannot be told: then it is still owed."""
        if self.speed is None:
            return
        with contextlib.suppress(SlamwareRefused):
            await self._client.set_system_parameter(Parameter(PARAMETER, f"{self.speed:.6f}"))
        self.speed = None
        await self._keep(None)

    async def _keep(self, what: list[str | float] | None) -> None:
        if Settings in self._robot:
            await self._robot[Settings].put(KEPT, what)
