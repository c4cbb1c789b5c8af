"""The light strips of a Slamware robot: an upper and a lower one, left and right."""

from __future__ import annotations

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.reported_light import ReportedLight
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import Clock
from roboglot.model.components.interaction.light import DARK, Colour, LightEffect, ZoneState
from roboglot.wire.slamware.chapters.system.devices import Channel, Half, LightColour, LightControl, Mode

LAMPS = 20  # of each strip; assumed
HALVES = {
    "left": (Channel.ONE, Half.LEFT),
    "right": (Channel.ONE, Half.RIGHT),
    "left_lower": (Channel.TWO, Half.LEFT),
    "right_lower": (Channel.TWO, Half.RIGHT),
}
MODES = {
    LightEffect.SOLID: Mode.ALWAYS_BRIGHT,
    LightEffect.OFF: Mode.ALWAYS_BRIGHT,
    LightEffect.FLASH: Mode.BLINK,
    LightEffect.BREATH: Mode.BREATHE,
    LightEffect.SCROLLING: Mode.HORSE_LAMP,
}


class SlamwareLight(ReportedLight):
    """``light/control``. The robot's steps of 1 ms limit the pace of breathing."""

    effects = MODES
    singly = False

    def __init__(self, clock: Clock, client: SlamwareClient, supervisor: Supervisor) -> None:
        super().__init__(dict.fromkeys(HALVES, LAMPS), clock, supervisor)
        self._client = client

    async def send_zone(self, zone: str, state: ZoneState, lamp: int | None) -> None:
        channel, half = HALVES[zone]
        period = 1000 / state.frequency  # ms
        colour = DARK if state.effect is LightEffect.OFF else state.colour
        control = LightControl(channel, half, MODES[state.effect], _parts(colour))
        match state.effect:
            case LightEffect.FLASH:
                control.bright_ms = control.off_ms = round(period / 2)
            case LightEffect.BREATH:  # from the first colour to the second in steps of one, and back
                control.color, control.brightness_end_color = LightColour(), _parts(colour)
                steps = 2 * max(colour.red, colour.green, colour.blue, 1)
                control.bright_ms = max(1, round(period / steps))
            case LightEffect.SCROLLING:
                control.bright_ms = round(period / LAMPS)
        await self._client.set_light_control(control)


def _parts(colour: Colour) -> LightColour:
    return LightColour(colour.red, colour.green, colour.blue)
