"""Lamps that cannot be asked: at every connection they are told again what they show, at first nothing."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping

from roboglot.clients.errors import RefusedByRobot
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import Clock
from roboglot.model.components.interaction.light import (
    WHITE,
    Colour,
    LightEffect,
    ZoneState,
)
from roboglot.model.components.interaction.light_effects import ShownLight
from roboglot.model.errors import InvalidGoal


class ReportedLight(ShownLight):
    """A driver says which ``effects`` its robot knows, and how one of them is ``tell``-ed."""

    effects: Collection[LightEffect]
    singly = True  # whether one lamp of a zone can be told

    def __init__(self, zones: Mapping[str, int], clock: Clock, supervisor: Supervisor) -> None:
        super().__init__(zones, clock)
        self._supervisor = supervisor

    @abstractmethod
    async def tell(self, zone: str, told: ZoneState, lamp: int | None) -> None:
        """Have a zone, or one of its lamps (from 0), show this. Raises ClientError."""

    async def learn(self) -> None:
        """Have all zones show what they were told. Raises RefusedByRobot if there is none of them."""
        refusal: RefusedByRobot | None = None
        for zone, count in tuple(self.zones.items()):
            told = [self.commanded(zone, lamp) for lamp in range(count)]
            try:
                if all(one == told[0] for one in told):
                    await self.tell(zone, told[0], None)
                else:
                    for lamp, one in enumerate(told):
                        await self.tell(zone, one, lamp)
            except RefusedByRobot as refused:
                del self.zones[zone]
                refusal = refused
        if refusal and not self.zones:
            raise refusal

    def shine(
        self,
        zone: str,
        colour: Colour = WHITE,
        effect: LightEffect = LightEffect.SOLID,
        *,
        frequency: float = 2.0,
        lamp: int | None = None,
    ) -> None:
        if lamp is not None and not self.singly:
            raise InvalidGoal("the lamps of this robot cannot be told one by one")
        if effect not in self.effects:
            raise InvalidGoal(f"this robot's lamps do not know {effect}; they know {', '.join(self.effects)}")
        self._supervisor.link.require()
        super().shine(zone, colour, effect, frequency=frequency, lamp=lamp)
        self._supervisor.send(f"the light {zone}", self.tell(zone, self.state(zone), lamp))
