"""cyberdog.led: lights on the head, the tail and around the eyes (4.4.09)."""

from __future__ import annotations

from weakref import WeakKeyDictionary

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.light import Colour, Light, LightEffect, ZoneState
from roboglot.model.errors import InvalidGoal, NotFound, RobotError
from roboglot.programs.functions.enums import (
    EYE_EFFECTS,
    EYE_SYSTEM_EFFECTS,
    LED_TARGETS,
    LINE_EFFECTS,
    LINE_FIRST,
    LINE_OFF,
    SYSTEM_COLOURS,
)
from roboglot.programs.functions.moving.outcomes import PROTECTED_UP_TO
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

TARGET_ERROR, EFFECT_ERROR, LOW_PRIORITY, NO_ANSWER = 1121, 1124, 1125, 1107

Look = tuple[LightEffect, float]  # an effect and its frequency, Hz
ZONES = {LED_TARGETS["target_head"]: "head", LED_TARGETS["target_tail"]: "tail", LED_TARGETS["target_mini"]: "eyes"}
_LOOKS: dict[str, Look] = {
    "on": (LightEffect.SOLID, 1.0),
    "blink": (LightEffect.FLASH, 1.0),
    "blink_fast": (LightEffect.FLASH, 3.0),
    "breath": (LightEffect.BREATH, 0.4),
    "breath_fast": (LightEffect.BREATH, 1.2),
    "one_by_one": (LightEffect.FILLING, 0.5),
    "one_by_one_fast": (LightEffect.FILLING, 1.5),
}
_COLOURS = {"red": Colour(255, 0, 0), "blue": Colour(0, 0, 255), "yellow": Colour(255, 255, 0)}
_DARK = (LightEffect.OFF, 1.0)
EYE_COLOUR = Colour(255, 255, 255)
FIRST_HUE = Colour(255, 0, 0)  # of figures with a circling hue
FIGURES = 0.5  # Hz of the eyes' figures

LINE: dict[int, Look] = {number: _LOOKS[name] for number, name in enumerate(LINE_EFFECTS, 1)}
EYES: dict[int, Look] = {
    EYE_EFFECTS["effect_mini_circular_breath"]: _LOOKS["breath"],
    EYE_EFFECTS["effect_mini_circular_ring"]: (LightEffect.SCROLLING, 1.0),
}
SYSTEM_LINE: dict[int, tuple[Look, Colour]] = {LINE_OFF: (_DARK, Colour())} | {
    LINE_FIRST + len(LINE_EFFECTS) * group + place: (_LOOKS[name], _COLOURS[colour])
    for group, colour in enumerate(SYSTEM_COLOURS)
    for place, name in enumerate(LINE_EFFECTS)
}
SYSTEM_EYES: dict[int, tuple[Look, Colour]] = {
    EYE_SYSTEM_EFFECTS["system_effect_mini_off"]: (_DARK, Colour()),
    EYE_SYSTEM_EFFECTS["system_effect_mini_rectangle_color"]: ((LightEffect.CORNERS, FIGURES), FIRST_HUE),
    EYE_SYSTEM_EFFECTS["system_effect_mini_centre_color"]: ((LightEffect.BAND, FIGURES), FIRST_HUE),
    EYE_SYSTEM_EFFECTS["system_effect_mini_three_circular"]: ((LightEffect.TRIAD, FIGURES), EYE_COLOUR),
    EYE_SYSTEM_EFFECTS["system_effect_mini_one_by_one"]: (_LOOKS["one_by_one"], EYE_COLOUR),
}


class HeldZone:
    """A zone that programs have taken: its state before, and each program's look, that of the last request last."""

    def __init__(self, before: ZoneState) -> None:
        self.before = self.shown = before  # ``shown``: after the programs' last command
        self.looks: dict[object, ZoneState] = {}


_held: WeakKeyDictionary[Light, dict[str, HeldZone]] = WeakKeyDictionary()


class HeldLights:
    """Zones that the program has taken. Other programs and clients may take them, too: the last request is shown."""

    def __init__(self, session: Session) -> None:
        self._light = session.robot[Light]
        self._zones = _held.setdefault(self._light, {})
        self._me = object()  # stands for this program, and keeps nothing of it alive

    def shine(self, zone: str, look: Look, colour: Colour) -> None:
        """Take the zone and show an effect. Raises like ``Light.shine``."""
        before = self._light.state(zone)
        effect, frequency = look
        self._light.shine(zone, colour, effect, frequency=frequency)
        held = self._zones.get(zone)
        if held is None or held.shown != before:  # another client's command ends what programs showed
            held = self._zones[zone] = HeldZone(before)
        held.looks.pop(self._me, None)
        held.looks[self._me] = held.shown = self._light.state(zone)

    def free(self, zone: str) -> None:
        """Give a zone back: to the program that asked before, or to its state before all of them.

        Changes nothing if it is not held, or if another program or client has commanded it since. Raises like
        ``Light.shine``.
        """
        shown = self._light.state(zone)
        held = self._zones.get(zone)
        if held is None or self._me not in held.looks:
            return
        others = {program: look for program, look in held.looks.items() if program is not self._me}
        if shown == held.shown == held.looks[self._me]:
            back = next(reversed(others.values()), held.before)
            self._light.shine(zone, back.colour, back.effect, frequency=back.frequency)
            held.shown = self._light.state(zone)
            if others:
                others[next(reversed(others))] = held.shown
        held.looks = others
        if not others:
            del self._zones[zone]

    def close(self) -> None:
        """Give all zones back, even if one cannot be. Raises like ``Light.shine``."""
        failure: RobotError | None = None
        for zone, held in tuple(self._zones.items()):
            try:
                self.free(zone)
            except RobotError as error:
                failure = error
                held.looks.pop(self._me, None)
        if failure is not None:
            raise failure


@ABILITIES.on("cyberdog.led.play", needs=(Light,))
async def play(session: Session, target: int, effect: int) -> Record:
    """Show one of the system's effects until the next request, or until the program ends."""
    shown = (SYSTEM_EYES if ZONES.get(target) == "eyes" else SYSTEM_LINE).get(effect)
    return _show(session, target, *shown) if shown else _show(session, target, None, Colour())


@ABILITIES.on("cyberdog.led.play_rgb", needs=(Light,))
async def play_rgb(session: Session, target: int, effect: int, r: int, g: int, b: int) -> Record:
    """Show an effect in any colour (0 to 255 each) until the next request, or until the program ends."""
    look = (EYES if ZONES.get(target) == "eyes" else LINE).get(effect)
    return _show(session, target, look, Colour(r, g, b))


@ABILITIES.on("cyberdog.led.freed", needs=(Light,))
async def freed(session: Session, target: int) -> Record:
    """Release the light: it shows again what it did before, unless others have taken it since."""
    if target not in ZONES:
        return _answer(TARGET_ERROR, "no such light")
    try:
        session.part(HeldLights).free(ZONES[target])
    except NotFound as error:
        return _answer(TARGET_ERROR, str(error))
    except RobotError as error:
        return _answer(NO_ANSWER, str(error))
    return _answer(0)


def _show(session: Session, target: int, look: Look | None, colour: Colour) -> Record:
    """Show an effect after the vendor's checks, in their order. At low power programs get no lights."""
    robot = session.robot
    if target not in ZONES:
        return _answer(TARGET_ERROR, "no such light")
    if look is None:
        return _answer(EFFECT_ERROR, "this light has no such effect")
    try:
        if Battery in robot and robot[Battery].state.percentage <= PROTECTED_UP_TO:
            return _answer(LOW_PRIORITY, "the battery is low: the lights are kept dark")
        session.part(HeldLights).shine(ZONES[target], look, colour)
    except (InvalidGoal, NotFound) as error:
        return _answer(EFFECT_ERROR if isinstance(error, InvalidGoal) else TARGET_ERROR, str(error))
    except RobotError as error:
        return _answer(NO_ANSWER, str(error))
    return _answer(0)


def _answer(code: int, words: str = "success") -> Record:
    outcome = state(StateCode.FAIL, words) if code else state()
    return Record("LedSeviceResponse", {"state": outcome, "response": Record("LedSeviceResponseBody", {"code": code})})
