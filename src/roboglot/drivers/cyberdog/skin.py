"""The dog's electronic skin, which cannot be asked: at every connection it is told again what it shows."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from roboglot.clients.cyberdog import CyberDogClient
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.interaction.skin import Shade, SkinPattern
from roboglot.model.components.interaction.skin_effects import ShownSkin
from roboglot.model.components.motion.feet import Foot, FootState
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.codes import SkinMode


class CyberDogSkin(ShownSkin):
    """``shades`` are those of the trunk, as they follow from what was told; chance is the dog's own."""

    def __init__(self, robot: Robot, client: CyberDogClient, supervisor: Supervisor) -> None:
        super().__init__(robot.clock, robot.id)
        self._client, self._supervisor = client, supervisor
        self._telling = asyncio.Lock()  # what is told last is what counts

    @property
    def feet(self) -> Mapping[Foot, FootState]:
        return {}

    def enable(self, on: bool) -> None:
        self._supervisor.link.require()
        super().enable(on)
        self._supervisor.send("switching the skin", self.learn())

    def show(self, pattern: SkinPattern, *, cycle: float = 1.0, standing: Shade = Shade.LIGHT) -> None:
        self._supervisor.link.require()
        super().show(pattern, cycle=cycle, standing=standing)
        self._supervisor.send("the skin's pattern", self.learn())

    async def learn(self) -> None:
        """Have it show what it was told. Raises ClientError."""
        async with self._telling:
            told = self.state
            await self._client.enable_skin(told.enabled)
            if told.enabled:
                by_feet = told.pattern is SkinPattern.FOOTFALLS
                time = int(told.standing is Shade.DARK) if by_feet else round(1000 * told.cycle)
                await self._client.set_skin(SkinMode[told.pattern.name], time)
