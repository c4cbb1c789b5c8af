"""Named random streams: one seed, an independent generator for each purpose."""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np


class RandomStreams:
    """All random streams of one world."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._streams: dict[tuple[str, ...], np.random.Generator] = {}
        self._drawers: list[Callable[[], None]] = []

    def of(self, *names: str) -> np.random.Generator:
        """Return the generator of these names, the same at every call."""
        return self._streams.setdefault(names, _stream(self.seed, names))

    def on_reseed(self, forget: Callable[[], None]) -> None:
        """Call ``forget`` at every reseeding: for parts that draw numbers in advance."""
        self._drawers.append(forget)

    def reseed(self, seed: int) -> None:
        """Restart every stream as in a new world with ``seed``."""
        self.seed = seed
        for forget in self._drawers:
            forget()
        for names, generator in self._streams.items():
            generator.bit_generator.state = _stream(seed, names).bit_generator.state


def _stream(seed: int, names: tuple[str, ...]) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64([seed, *(zlib.crc32(name.encode()) for name in names)]))
