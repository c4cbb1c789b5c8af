"""Footfalls: the feet in the air by the phase of a gait, or by a given order. Pure time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

from roboglot.model.components.motion.feet import Foot, Footfall, Foothold
from roboglot.model.components.motion.gaits import GAITS, Gait
from roboglot.model.components.motion.legs import FootLift
from roboglot.values import dataclass

RAISING = 0.2  # s to raise a foot that stays in the air
DUTY = 0.55  # of a step for which a foot stands


@dataclass(frozen=True, slots=True)
class Swing:
    """A foot in the air after ``share`` of its way: it lands in ``left`` s, then stands for ``stand`` s.

    ``left`` is infinite for a foot that is kept up. ``landing``: final downward speed, as a share of the upward one.
    """

    share: float
    left: float
    stand: float
    to: Foothold
    landing: float = 1.0

    @property
    def rise(self) -> float:
        """Height as a share of the lift: 0 to 1 to 0."""
        if self.left == math.inf:
            return self.share
        up = math.sin(math.pi * self.share)
        if self.share <= 0.5 or self.landing == 1.0:
            return up
        down = 2.0 * self.share - 1.0
        soft = 1.0 - down * down * (3.0 - 2.0 * down)
        return max(0.0, soft + (up - soft) * self.landing)


Swings = tuple[Swing | None, ...]  # one per foot; None: the foot stands
DOWN: Swings = (None,) * len(Foot)

# When each foot rises, as a share of a step; None: it never comes down. Trots move diagonal pairs.
_TROT = (0.0, 0.5, 0.5, 0.0)
_CRAWL = (0.0, 0.5, 0.75, 0.25)
_RISES: Mapping[Gait, tuple[float | None, ...]] = {
    Gait.BOUND: (0.0, 0.0, 0.5, 0.5),
    Gait.PRONK: (0.0,) * 4,
    Gait.HOP: (0.0,) * 4,
    Gait.THREE_LEGS: (None, 0.33, 0.67, 0.0),
    Gait.STAIRS: _CRAWL,
    Gait.SLOPE: _CRAWL,
}
_DUTIES: Mapping[Gait, float] = {Gait.STAIRS: 0.75, Gait.SLOPE: 0.75, Gait.THREE_LEGS: 0.67}


@lru_cache(maxsize=64)
def lifted(lift: FootLift) -> tuple[Foothold, ...]:
    """Return the footholds (in the order of Foot) of feet lifted by ``lift`` that land in their places."""
    front, rear = Foothold(lift=lift.front), Foothold(lift=lift.rear)
    return front, front, rear, rear


def walking(gait: Gait, strides: float, lift: FootLift) -> Swings:
    """Return the swing of each foot after ``strides`` steps of every leg; None for feet on the floor."""
    rate, duty = GAITS[gait].steps, _DUTIES.get(gait, DUTY)
    swings: list[Swing | None] = []
    for to, rises in zip(lifted(lift), _RISES.get(gait, _TROT), strict=True):
        if rises is None:
            swings.append(Swing(1.0, math.inf, 0.0, to))
            continue
        phase = (strides - rises) % 1.0
        up = 1.0 - duty
        swings.append(Swing(phase / up, (up - phase) / rate, duty / rate, to) if phase < up else None)
    return tuple(swings)


class FootfallCycle:
    """Footfalls, repeated endlessly."""

    def __init__(self, footfalls: Sequence[Footfall]) -> None:
        self.period = math.fsum(footfall.seconds for footfall in footfalls)
        self._flights = [_flights(footfalls, foot) for foot in Foot]

    def swings(self, time: float, feet: Sequence[Foothold], landing: float) -> Swings:
        """Return the swing of each foot ``time`` s after the start; None for feet on the floor."""
        return tuple(self._swing(flights, time, to, landing) for flights, to in zip(self._flights, feet, strict=True))

    def _swing(self, flights: list[tuple[float, float]], time: float, to: Foothold, landing: float) -> Swing | None:
        phase = time % self.period
        for index, (start, length) in enumerate(flights):
            gone = (phase - start) % self.period
            if gone < length:
                if length >= self.period - 1e-9:  # it never comes down
                    return Swing(min(1.0, time / RAISING), math.inf, 0.0, to)
                stand = (flights[(index + 1) % len(flights)][0] - start) % self.period or self.period
                return Swing(gone / length, length - gone, stand - length, to, landing)
        return None


def _flights(footfalls: Sequence[Footfall], foot: Foot) -> list[tuple[float, float]]:
    """Return start and length of the foot's flights, s; a flight may last from the last footfall into the first."""
    flights: list[tuple[float, float]] = []
    start, flying = 0.0, False
    for footfall in footfalls:
        if foot not in footfall.down:
            if flying:
                flights[-1] = (flights[-1][0], flights[-1][1] + footfall.seconds)
            else:
                flights.append((start, footfall.seconds))
        flying = foot not in footfall.down
        start += footfall.seconds
    if len(flights) > 1 and flying and foot not in footfalls[0].down:
        _, more = flights.pop(0)
        flights[-1] = (flights[-1][0], flights[-1][1] + more)
    return flights
