"""Lamps without read-back: the driver sends their state again at every connection, at first dark."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping

from roboglot.clients.errors import RefusedByRobot
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import Clock
from roboglot.model.components.interaction.light import WHITE, Colour, LightEffect, ZoneState
from roboglot.model.components.interaction.light_effects import ShownLight
from roboglot.model.errors import InvalidGoal


class ReportedLight(ShownLight):
    """Subclasses list the ``effects`` of their robot, and send them in ``send_zone``."""

    effects: Collection[LightEffect]
    singly = True  # whether single lamps of a zone can be set

    def __init__(self, zones: Mapping[str, int], clock: Clock, supervisor: Supervisor) -> None:
        super().__init__(zones, clock)
        self._supervisor = supervisor
        self._confirmed: dict[str, list[ZoneState]] = {}  # by zone: of each lamp, and the last command

    @abstractmethod
    async def send_zone(self, zone: str, state: ZoneState, lamp: int | None) -> None:
        """Set a zone, or one of its lamps (from 0), to ``state``. Raises ClientError."""

    async def probe(self) -> None:
        """Send the state of every zone. Raises RefusedByRobot if the robot has none of them."""
        refusal: RefusedByRobot | None = None
        for zone, count in tuple(self.zones.items()):
            lamps = [self.commanded(zone, lamp) for lamp in range(count)]
            try:
                if all(state == lamps[0] for state in lamps):
                    await self.send_zone(zone, lamps[0], None)
                else:
                    for lamp, state in enumerate(lamps):
                        await self.send_zone(zone, state, lamp)
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
            raise InvalidGoal("the lamps of this robot cannot be set one by one")
        if effect not in self.effects:
            raise InvalidGoal(f"this robot's lamps do not know {effect}; they know {', '.join(self.effects)}")
        self._supervisor.require()
        confirmed = self._confirmed.setdefault(zone, [*self._lamps(zone), self.state(zone)])
        super().shine(zone, colour, effect, frequency=frequency, lamp=lamp)
        sent, lamps = self.state(zone), self._lamps(zone)
        changed = range(len(lamps)) if lamp is None else (lamp,)

        async def send() -> None:
            await self.send_zone(zone, sent, lamp)
            for index in (*changed, -1):
                confirmed[index] = sent

        def undo() -> None:
            for index in changed:
                if lamps[index] is sent:  # else a later command replaced it
                    lamps[index] = confirmed[index]
            if self.state(zone) is sent:
                self._last[zone] = confirmed[-1]

        self._supervisor.send_setting(f"the light {zone}", send, undo)
