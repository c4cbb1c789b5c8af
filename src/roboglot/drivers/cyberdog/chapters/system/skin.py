"""The electronic skin of a dog. It has no read-back, so its state is sent again at every connection."""

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
    """``shades`` of the trunk follow from the commands; random patterns are the dog's own."""

    def __init__(self, robot: Robot, client: CyberDogClient, supervisor: Supervisor) -> None:
        super().__init__(robot.clock, robot.id)
        self._client, self._supervisor = client, supervisor
        self._sending = asyncio.Lock()  # the last state wins
        self._confirmed = self._state

    @property
    def feet(self) -> Mapping[Foot, FootState]:
        return {}

    def enable(self, on: bool) -> None:
        self._supervisor.require()
        super().enable(on)
        self._send("switching the skin")

    def show(self, pattern: SkinPattern, *, cycle: float = 1.0, standing: Shade = Shade.LIGHT) -> None:
        self._supervisor.require()
        super().show(pattern, cycle=cycle, standing=standing)
        self._send("the skin's pattern")

    def _send(self, what: str) -> None:
        """Send the state; if the dog refuses it and no later command replaced it, return to the last confirmed one."""
        sent = self._state

        def undo() -> None:
            if self._state is sent:
                self._state = self._confirmed

        self._supervisor.send_setting(what, self.probe, undo)

    async def probe(self) -> None:
        """Send the current state. Raises ClientError."""
        async with self._sending:
            state = self.state
            await self._client.enable_skin(state.enabled)
            if state.enabled:
                by_feet = state.pattern is SkinPattern.FOOTFALLS
                time = int(state.standing is Shade.DARK) if by_feet else round(1000 * state.cycle)
                await self._client.set_skin(SkinMode[state.pattern.name], time)
            self._confirmed = state
