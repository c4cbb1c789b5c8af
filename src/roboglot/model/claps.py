"""Counts claps in what a microphone hears: short bursts, much louder than before and after. Knows no microphone."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.perception import ClapsHeard
from roboglot.model.sound import SAMPLE_RATE, SoundBlock

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

WINDOW = 240  # samples: 5 ms
BEFORE, AFTER = 30, 14  # windows around a burst for comparison: 150 ms and 70 ms
LOUDEST_FIRST = 4  # windows within which a burst must have reached its peak: 20 ms
THRESHOLD = 0.01 * 32767  # root mean square below which no sound counts as a clap
RISE, FALL = 5.0, 0.3  # factors by which a burst exceeds the sound before it, and by which it decays
GAP_MIN, GAP_MAX = 0.1, 0.8  # s between the claps of a run


class ClapCounter:
    """Counts claps in gapless blocks; a run is complete once GAP_MAX has passed without a further clap."""

    def __init__(self) -> None:
        self._levels: deque[float] = deque(maxlen=BEFORE + LOUDEST_FIRST + AFTER)
        self._count = 0
        self._last = -np.inf

    def feed(self, block: SoundBlock) -> ClapsHeard | None:
        """Listen to the next block."""
        samples = block.samples[: len(block.samples) // WINDOW * WINDOW].reshape(-1, WINDOW)
        levels = np.sqrt(np.mean(np.square(samples, dtype=np.float64), axis=1))
        for number, level in enumerate(levels.tolist()):
            self._levels.append(level)
            end = block.stamp + (number + 1) * WINDOW / SAMPLE_RATE
            if self._is_clap():
                stamp = end - (LOUDEST_FIRST + AFTER) * WINDOW / SAMPLE_RATE
                if stamp - self._last >= GAP_MIN:
                    self._count += 1
                    self._last = stamp
        if self._count and block.stamp - self._last > GAP_MAX + (LOUDEST_FIRST + AFTER) * WINDOW / SAMPLE_RATE:
            heard = ClapsHeard(self._last, self._count)
            self._count = 0
            return heard
        return None

    def _is_clap(self) -> bool:
        """True if a burst begins in the window after the first BEFORE ones."""
        levels = self._levels
        if len(levels) < BEFORE + LOUDEST_FIRST + AFTER:
            return False
        whole = np.array(levels)
        before, burst, after = np.split(whole, (BEFORE, BEFORE + LOUDEST_FIRST))
        peak = burst.max()
        if peak < THRESHOLD or burst[0] < 0.5 * peak:
            return False
        # The last window before it may contain the burst's onset.
        return bool(peak > RISE * max(before[:-1].mean(), before[-2]) and after[-2:].mean() < FALL * peak)
