"""The LED chapter (manual 3.2.9)."""

from __future__ import annotations

from roboglot.model.components.interaction.light import Colour, Light, LightEffect
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import BlinkRate, ColourPart, Effect, LampNumber
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.vocabulary import EFFECTS, ZONES


@TABLE.on("led control", right=Right.DRIVE, needs=(Light,))
def control(
    context: Context,
    *,
    comp: str,
    effect: Effect,
    r: ColourPart = 255,
    g: ColourPart = 255,
    b: ColourPart = 255,
    blink_freq: BlinkRate = 2,
    single_led_index: LampNumber | None = None,
) -> None:
    """Light the lamps of comp (several joined by ``|``) in a colour with an effect (3.2.9.1).

    scrolling applies to the gimbal's rings only, and fails without one. blink_freq (Hz) and single_led_index (one lamp
    of a ring, solid or off) are in no manual.
    """
    light, kind = context.robot[Light], EFFECTS[effect]
    zones = [zone for zone in _zones(comp, light) if zone in light.zones]
    if kind is LightEffect.SCROLLING or single_led_index is not None:
        zones = [zone for zone in zones if light.zones[zone] > 1]
    if not zones:
        raise NotFound(f"the lamps of {comp} cannot do this")
    if single_led_index is not None and kind not in (LightEffect.SOLID, LightEffect.OFF):
        raise InvalidGoal(f"a single lamp is solid or off, not {effect}")
    for zone in zones:
        lamp = None if single_led_index is None else single_led_index - 1
        light.shine(zone, Colour(r, g, b), kind, frequency=float(blink_freq), lamp=lamp)


def _zones(comp: str, light: Light) -> dict[str, None]:
    """Return the named zones, each once; ``all``: all zones that the robot has."""
    if strangers := [name for name in comp.split("|") if name not in ZONES]:
        raise InvalidGoal(f"comp is one of {', '.join(ZONES)}, not {strangers[0]!r}")
    names = comp.split("|")
    return dict.fromkeys(zone for name in names for zone in (light.zones if name == "all" else ZONES[name]))
