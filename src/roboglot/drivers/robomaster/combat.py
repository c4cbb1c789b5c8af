"""The EP's blaster and armor. What was told to them is known from then on; a refusal takes it back."""

from __future__ import annotations

from functools import partial

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster.telling import tell
from roboglot.drivers.supervisor import Keeper
from roboglot.model.clock import Clock
from roboglot.model.components.interaction.armor import SENSITIVITY_MAX, Armor, PlatePlace
from roboglot.model.components.interaction.blaster import BEADS_MAX, Blaster
from roboglot.model.errors import Busy, InvalidGoal, Refused

AROUND = (PlatePlace.REAR, PlatePlace.FRONT, PlatePlace.LEFT, PlatePlace.RIGHT)
AT_GIMBAL = (PlatePlace.GIMBAL_LEFT, PlatePlace.GIMBAL_RIGHT)


class RoboMasterBlaster(Blaster):
    """Beads that leave are not told, so there are no ``BeadFired``; ``firing`` goes by the pace of a shot."""

    rate = 8.0

    def __init__(self, clock: Clock, client: RoboMasterClient, keeper: Keeper) -> None:
        self._clock, self._client, self._keeper = clock, client, keeper
        self._beads, self._until = 1, -1.0

    async def learn(self) -> None:
        """Ask how many beads a shot has."""
        self._beads = await self._client.blaster.get_bead()

    @property
    def beads(self) -> int:
        return self._beads

    def set_beads(self, beads: int) -> None:
        if not 1 <= beads <= BEADS_MAX:
            raise InvalidGoal(f"a shot has 1 to {BEADS_MAX} beads, not {beads}")

        def set_(value: int) -> None:
            self._beads = value

        undo = partial(set_, self._beads)
        tell(self._keeper, "setting the beads of a shot", lambda: self._client.blaster.bead(beads), undo)
        set_(beads)

    @property
    def ammo(self) -> int:
        raise Refused("an EP does not tell how many beads it has left")

    @property
    def firing(self) -> bool:
        return self._clock.time() < self._until

    def fire(self) -> int:
        if self.firing:
            raise Busy("the last shot is still being fired")
        self._keeper.send("firing", self._client.blaster.fire())
        self._until = self._clock.time() + self._beads / self.rate
        return self._beads

    def cease(self) -> None:
        """Nothing holds back a shot of an EP."""

    def reload(self) -> None:
        raise Refused("an EP is filled by hand")


class RoboMasterArmor(Armor):
    """Hits come on the event port; the watch publishes them."""

    def __init__(self, client: RoboMasterClient, keeper: Keeper) -> None:
        self._client, self._keeper = client, keeper
        self.plates = AROUND
        self._sensitivity = 5

    async def learn(self, *, gimbal: bool) -> None:
        """Ask for the sensitivity, and have hits told."""
        self._sensitivity = await self._client.armor.get_sensitivity()
        await self._client.armor.event(True)
        self.plates = (*AROUND, *AT_GIMBAL) if gimbal else AROUND

    @property
    def sensitivity(self) -> int:
        return self._sensitivity

    def set_sensitivity(self, sensitivity: int) -> None:
        if not 0 <= sensitivity <= SENSITIVITY_MAX:
            raise InvalidGoal(f"a sensitivity is 0 to {SENSITIVITY_MAX}, not {sensitivity}")

        def set_(value: int) -> None:
            self._sensitivity = value

        undo = partial(set_, self._sensitivity)
        tell(self._keeper, "setting the sensitivity", lambda: self._client.armor.sensitivity(sensitivity), undo)
        set_(sensitivity)
