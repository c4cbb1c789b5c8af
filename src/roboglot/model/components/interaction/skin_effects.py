"""Patterns of an electronic skin over time: shades follow from command, clock and feet. Drives no hardware."""

from __future__ import annotations

import hashlib
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace

from roboglot.model.clock import Clock
from roboglot.model.components.interaction.skin import (
    CYCLE_MAX,
    CYCLE_MIN,
    ElectronicSkin,
    Patch,
    Shade,
    SkinPattern,
    SkinState,
)
from roboglot.model.components.motion.feet import Foot, FootState
from roboglot.model.errors import InvalidGoal, Refused

TRUNK = (Patch.FRONT, Patch.MIDDLE, Patch.REAR)
LEGS: Mapping[Patch, Foot] = dict(zip(tuple(Patch)[len(TRUNK) :], Foot, strict=True))
FROM_FRONT: Mapping[Patch, int] = {  # the third of the body in which a patch lies
    **{patch: third for third, patch in enumerate(TRUNK)},
    Patch.RIGHT_FRONT_LEG: 0,
    Patch.LEFT_FRONT_LEG: 0,
    Patch.RIGHT_REAR_LEG: 2,
    Patch.LEFT_REAR_LEG: 2,
}  # fmt: skip


class ShownSkin(ElectronicSkin):
    """Computes shades on request; runs nothing in between. Switched on and dark at first; ``seed`` is for RANDOM."""

    def __init__(self, clock: Clock, seed: str) -> None:
        self._clock, self._seed = clock, seed
        self.start_afresh()

    def start_afresh(self) -> None:
        """Be switched on and dark, as after every start."""
        self._state = SkinState(True, SkinPattern.DARK, 1.0, Shade.LIGHT, self._clock.time())

    @property
    @abstractmethod
    def feet(self) -> Mapping[Foot, FootState]:
        """Contact of the legs that have patches; empty where unknown."""

    @property
    def state(self) -> SkinState:
        return self._state

    def enable(self, on: bool) -> None:
        if on != self._state.enabled:
            self._state = replace(self._state, enabled=on, since=self._clock.time())

    def show(self, pattern: SkinPattern, *, cycle: float = 1.0, standing: Shade = Shade.LIGHT) -> None:
        if not CYCLE_MIN <= cycle <= CYCLE_MAX:
            raise InvalidGoal(f"a skin's cycle takes {CYCLE_MIN:g} to {CYCLE_MAX:g} s, not {cycle:g}")
        if not self._state.enabled:
            raise Refused("the skin is switched off")
        self._state = SkinState(True, pattern, cycle, standing, self._clock.time())

    @property
    def shades(self) -> Mapping[Patch, Shade]:
        feet, state = self.feet, self._state
        patches = (*TRUNK, *(patch for patch, foot in LEGS.items() if foot in feet))
        turns = (self._clock.time() - state.since) / state.cycle
        if not state.enabled:
            return dict.fromkeys(patches, Shade.DARK)
        if state.pattern is SkinPattern.FOOTFALLS:
            planted = {patch for patch in patches if patch in LEGS and feet[LEGS[patch]].grounded}
            return {patch: _shade((patch in planted) is (state.standing is Shade.LIGHT)) for patch in patches}
        return {patch: _shade(self._is_light(state.pattern, patch, turns)) for patch in patches}

    def _is_light(self, pattern: SkinPattern, patch: Patch, turns: float) -> bool:
        """Return whether the patch is light; ``turns``: cycles elapsed."""
        whole = int(turns)
        reached = 3.0 * (turns - whole)  # thirds of the body that the wave has passed
        match pattern:
            case SkinPattern.LIGHT:
                return True
            case SkinPattern.FLASH:
                return whole % 2 == 0
            case SkinPattern.RANDOM:
                drawn = hashlib.blake2b(f"{self._seed} {whole}".encode(), digest_size=1).digest()[0]
                return bool(drawn >> tuple(Patch).index(patch) & 1)
            case SkinPattern.REARWARD:
                return (whole % 2 == 0) is (FROM_FRONT[patch] <= reached)
            case SkinPattern.FORWARD:
                return (whole % 2 == 0) is (2 - FROM_FRONT[patch] <= reached)
            case _:
                return False


def _shade(light: bool) -> Shade:
    return Shade.LIGHT if light else Shade.DARK
