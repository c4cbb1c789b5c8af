"""Chapter "system": light strips. A show is an action that holds its zone, so the next one replaces it."""

from __future__ import annotations

from roboglot.model.actions import Action
from roboglot.model.clock import Clock
from roboglot.model.components.interaction.light import DARK, Colour, Light
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.system.devices import Channel, Half, LightColour, LightControl, Mode

STEP_MIN = 0.02  # s; shorter steps make no visible difference


ZONES = {
    (Channel.ONE, Half.LEFT): "left",
    (Channel.ONE, Half.RIGHT): "right",
    (Channel.TWO, Half.LEFT): "left_lower",
    (Channel.TWO, Half.RIGHT): "right_lower",
}


@TABLE.on("POST /api/core/system/v1/light/control", right=Right.DRIVE, needs=(Light,))
def set_light_control(context: Context, body: LightControl) -> None:
    """Set the light of one half of a channel; 501 if the robot has no such strip."""
    light, zone = context.robot[Light], ZONES[body.channel, body.control_part]
    if zone not in light.zones:
        raise HttpError(501, "Failed to set light control", f"this robot has no lights {zone}")
    show = Show(light, zone, context.robot.clock, body)

    async def run(_: Action) -> None:
        await show.run()

    context.robot.actions.start(f"light {zone}", run, resources={f"light {zone}"}, source=SOURCE)


class Show:
    """Light show of one zone."""

    def __init__(self, light: Light, zone: str, clock: Clock, wanted: LightControl) -> None:
        self._light, self._zone, self._clock, self._wanted = light, zone, clock, wanted
        self._step = max(wanted.bright_ms / 1000, STEP_MIN)

    async def run(self) -> None:
        """Show until cancelled, or set a constant light at once."""
        colour = _colour(self._wanted.color)
        match self._wanted.mode:
            case Mode.ALWAYS_BRIGHT:
                self._light.shine(self._zone, colour)
            case Mode.BLINK:
                while True:
                    await self._hold(colour, self._step)
                    await self._hold(DARK, max(self._wanted.off_ms / 1000, STEP_MIN))
            case Mode.BREATHE:
                await self._breathe(colour, _colour(self._wanted.brightness_end_color or LightColour()))
            case Mode.HORSE_LAMP:
                await self._run_round(colour)

    async def _hold(self, colour: Colour, seconds: float) -> None:
        self._light.shine(self._zone, colour)
        await self._clock.sleep(seconds)

    async def _breathe(self, low: Colour, high: Colour) -> None:
        """Raise the brightness by one every ``brightMs`` up to the top, then lower it again."""
        spans = (high.red - low.red, high.green - low.green, high.blue - low.blue)
        most = max(1, *spans)
        pace = max(self._wanted.bright_ms, 1) / 1000  # s per step; some may be skipped
        stride = max(1, round(STEP_MIN / pace))
        while True:
            for level in (*range(0, most, stride), *range(most, 0, -stride)):
                parts = (min(max(span, 0), level) for span in spans)
                red, green, blue = parts
                await self._hold(Colour(low.red + red, low.green + green, low.blue + blue), pace * stride)

    async def _run_round(self, colour: Colour) -> None:
        """Light one lamp after the other."""
        count, lamp = self._light.zones[self._zone], 0
        while True:
            self._light.shine(self._zone, DARK)
            self._light.shine(self._zone, colour, lamp=lamp)
            await self._clock.sleep(self._step)
            lamp = (lamp + 1) % count


def _colour(colour: LightColour) -> Colour:
    return Colour(colour.red, colour.green, colour.blue)
