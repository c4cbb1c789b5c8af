"""Propagation of sounds in the world: loss by distance, walls and slabs, delay by the speed of sound.

Truth, world frame; knows no microphone and no clock. No echoes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Point
from roboglot.model.sound import SAMPLE_RATE, Sound
from roboglot.simulation.radio.radio import crossed, walls_of
from roboglot.simulation.world.description import WorldDescription
from roboglot.values import dataclass

SPEED = 343.0  # m/s
NEAREST = 0.25  # m: nearer sources do not sound louder
WALL_LOSS = 0.15  # share of the amplitude that passes a wall
SLAB_LOSS = 0.01
STOREY = 3.0  # m of distance per floor
SOURCES_MAX = 100
LINGER = 2.0  # s after its end for which a sound may still arrive somewhere


@dataclass(frozen=True, slots=True)
class Speech:
    """The words in a sound, and the voiceprint of the speaker."""

    text: str
    voice: bytes


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A sound from ``start`` (s) on at a place; ``loudness``: factor of its amplitude at 1 m."""

    sound: Sound
    at: Point
    floor: int
    start: float
    loudness: float
    speech: Speech | None = None


@dataclass(frozen=True, slots=True)
class Heard:
    """An utterance that has fully arrived; ``level``: its RMS, ``noise``: that of other sounds (int16 units)."""

    source: Source
    level: float
    noise: float


class SoundField:
    """All sounds under way."""

    def __init__(self, world: WorldDescription) -> None:
        self._walls = walls_of(world)
        self._sources: list[Source] = []

    def emit(self, source: Source) -> None:
        """Add a sound. Raises ValueError for more than SOURCES_MAX at once."""
        over = source.start - LINGER
        self._sources = [other for other in self._sources if other.start + other.sound.seconds > over]
        if len(self._sources) >= SOURCES_MAX:
            raise ValueError(f"at most {SOURCES_MAX} sounds at once")
        self._sources.append(source)

    def silence(self, source: Source) -> None:
        """Stop a sound at once."""
        if source in self._sources:
            self._sources.remove(source)

    def heard(self, at: Point, floor: int, start: float, count: int) -> NDArray[np.float64]:
        """Return ``count`` samples that arrive at a place from ``start`` s on, in int16 units."""
        mixed = np.zeros(count)
        for source in self._sources:
            distance = source.at.distance_to(at) + STOREY * abs(source.floor - floor)
            first = round((start - source.start - distance / SPEED) * SAMPLE_RATE)
            samples = source.sound.samples
            begin, end = max(0, first), min(len(samples), first + count)
            if begin < end:
                mixed[begin - first : end - first] += samples[begin:end] * self._strength(source, at, floor, distance)
        return mixed

    def utterances(self, at: Point, floor: int, since: float, until: float) -> list[Heard]:
        """Return speech whose end arrives at a place after ``since`` and until ``until`` (s), in order of arrival."""
        found = []
        for source in self._sources:
            distance = source.at.distance_to(at) + STOREY * abs(source.floor - floor)
            over = source.start + source.sound.seconds + distance / SPEED
            if source.speech is not None and since < over <= until:
                others = [o for o in self._sources if o is not source and self._overlap(o, source)]
                noise = math.hypot(*(self._level(other, at, floor) for other in others)) if others else 0.0
                found.append((over, Heard(source, self._level(source, at, floor), noise)))
        return [heard for _, heard in sorted(found, key=lambda entry: entry[0])]

    def _level(self, source: Source, at: Point, floor: int) -> float:
        distance = source.at.distance_to(at) + STOREY * abs(source.floor - floor)
        samples = source.sound.samples
        loud = float(np.sqrt(np.mean(np.square(samples, dtype=np.float64)))) if len(samples) else 0.0
        return loud * self._strength(source, at, floor, distance)

    @staticmethod
    def _overlap(a: Source, b: Source) -> bool:
        return a.start < b.start + b.sound.seconds and b.start < a.start + a.sound.seconds

    def _strength(self, source: Source, at: Point, floor: int, distance: float) -> float:
        walls = crossed(self._walls[floor], source.at, at)
        slabs = abs(source.floor - floor)
        strength: float = source.loudness / max(NEAREST, distance) * WALL_LOSS**walls * SLAB_LOSS**slabs
        return strength
