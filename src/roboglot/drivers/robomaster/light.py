"""The EP's lamps. They cannot be asked, so they are told at every connection what they show: at first nothing."""

from __future__ import annotations

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.keeper import Keeper
from roboglot.drivers.robomaster.vocabulary import EFFECTS, LAMPS
from roboglot.model.clock import Clock
from roboglot.model.components.light import WHITE, Colour, LightEffect, ZoneState
from roboglot.model.components.shown_light import ShownLight
from roboglot.model.errors import InvalidGoal

AROUND = {"front": 1, "rear": 1, "left": 1, "right": 1}
RINGS = {"gimbal_left": 8, "gimbal_right": 8}
BLINK_MIN, BLINK_MAX = 1, 10  # Hz


class RoboMasterLight(ShownLight):
    """Blinks at whole Hz; how fast it breathes and scrolls is the robot's affair."""

    def __init__(self, clock: Clock, client: RoboMasterClient, keeper: Keeper) -> None:
        super().__init__(AROUND, clock)
        self._client, self._keeper = client, keeper

    async def learn(self, *, gimbal: bool) -> None:
        """Have all lamps show what they were told. Raises RefusedByRobot if there are none."""
        if gimbal:
            self.provide(RINGS)
        for zone, count in self.zones.items():
            told = [self.told(zone, lamp) for lamp in range(count)]
            if all(one == told[0] for one in told):
                await self._tell(zone, told[0], None)
            else:
                for lamp, one in enumerate(told):
                    await self._tell(zone, one, lamp)

    def shine(
        self,
        zone: str,
        colour: Colour = WHITE,
        effect: LightEffect = LightEffect.SOLID,
        *,
        frequency: float = 2.0,
        lamp: int | None = None,
    ) -> None:
        if effect not in EFFECTS:
            raise InvalidGoal(f"an EP's lamps do not know {effect}; they know {', '.join(EFFECTS)}")
        self._keeper.link.require()
        super().shine(zone, colour, effect, frequency=frequency, lamp=lamp)
        self._keeper.send(f"the light {zone}", self._tell(zone, self.state(zone), lamp))

    async def _tell(self, zone: str, told: ZoneState, lamp: int | None) -> None:
        colour, blinks = told.colour, told.effect is LightEffect.FLASH
        await self._client.led.control(
            LAMPS[zone], EFFECTS[told.effect], colour.red, colour.green, colour.blue,
            blink_freq=max(BLINK_MIN, min(BLINK_MAX, round(told.frequency))) if blinks else None,
            single_led_index=None if lamp is None else lamp + 1,
        )  # fmt: skip
