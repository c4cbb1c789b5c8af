"""The lamps of an EP: around the body, and a ring at each side of the gimbal."""

from __future__ import annotations

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.reported_light import ReportedLight
from roboglot.drivers.robomaster.vocabulary import EFFECTS, LAMPS
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import Clock
from roboglot.model.components.interaction.light import LightEffect, ZoneState

AROUND = {"front": 1, "rear": 1, "left": 1, "right": 1}
RINGS = {"gimbal_left": 8, "gimbal_right": 8}
BLINK_MIN, BLINK_MAX = 1, 10  # Hz


class RoboMasterLight(ReportedLight):
    """Blinks at whole Hz; the robot sets the pace of breathing and scrolling."""

    effects = EFFECTS

    def __init__(self, clock: Clock, client: RoboMasterClient, supervisor: Supervisor) -> None:
        super().__init__(AROUND, clock, supervisor)
        self._client = client

    async def send_zone(self, zone: str, state: ZoneState, lamp: int | None) -> None:
        colour, blinks = state.colour, state.effect is LightEffect.FLASH
        await self._client.led.control(
            LAMPS[zone], EFFECTS[state.effect], colour.red, colour.green, colour.blue,
            blink_freq=max(BLINK_MIN, min(BLINK_MAX, round(state.frequency))) if blinks else None,
            single_led_index=None if lamp is None else lamp + 1,
        )  # fmt: skip
