"""Named random streams: one seed, an independent generator for each purpose."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import DTypeLike, NDArray

KEPT_MAX = 4096  # streams whose seed is remembered: it takes ten times as long to make as the generator


class RandomStreams:
    """All random streams of one world."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._streams: dict[tuple[str, ...], np.random.Generator] = {}
        self._drawers: list[Callable[[], None]] = []

    def of(self, *names: str) -> np.random.Generator:
        """Return the generator of these names, the same at every call."""
        if names not in self._streams:
            self._streams[names] = _stream(self.seed, names)
        return self._streams[names]

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
    return np.random.Generator(np.random.PCG64(_seed_of(seed, names)))


class _Seed(np.random.SeedSequence):
    """Seed of one kind of generator: its words are computed once."""

    _words: NDArray[np.unsignedinteger] | None = None

    def generate_state(self, n_words: int, dtype: DTypeLike = np.uint32) -> NDArray[np.unsignedinteger]:
        """Return the words that the generator asks for."""
        if self._words is None:
            self._words = super().generate_state(n_words, dtype)  # type: ignore[arg-type]
        return self._words


@lru_cache(KEPT_MAX)
def _seed_of(seed: int, names: tuple[str, ...]) -> _Seed:
    return _Seed([seed, *(zlib.crc32(name.encode()) for name in names)])
