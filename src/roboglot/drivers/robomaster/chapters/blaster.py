"""The blaster of an EP. A setting counts as soon as it is sent; a refusal restores the value before it."""

from __future__ import annotations

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.setting import Setting
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import Clock
from roboglot.model.components.interaction.blaster import Blaster, check_beads
from roboglot.model.errors import Busy, Refused


class RoboMasterBlaster(Blaster):
    """The robot does not report fired beads, so there is no ``BeadFired``; ``firing`` follows from the rate of fire."""

    rate = 8.0

    def __init__(self, clock: Clock, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._clock, self._client, self._supervisor = clock, client, supervisor
        self._beads, self._until = Setting(supervisor, 1), -1.0

    async def probe(self) -> None:
        """Poll the number of beads per shot."""
        self._beads.read(await self._client.blaster.get_bead())

    @property
    def beads(self) -> int:
        return self._beads.value

    def set_beads(self, beads: int) -> None:
        check_beads(beads)
        self._beads.send("setting the beads of a shot", beads, lambda: self._client.blaster.bead(beads))

    @property
    def ammo(self) -> int:
        raise Refused("an EP does not report its remaining beads")

    @property
    def firing(self) -> bool:
        return self._clock.time() < self._until

    def fire(self) -> int:
        if self.firing:
            raise Busy("the last shot is still being fired")
        self._supervisor.send("firing", self._client.blaster.fire())
        self._until = self._clock.time() + self.beads / self.rate
        return self.beads

    def cease(self) -> None:
        """Do nothing: a shot of an EP cannot be cancelled."""

    def reload(self) -> None:
        raise Refused("an EP is filled by hand")
