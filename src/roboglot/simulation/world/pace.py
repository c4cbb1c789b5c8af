"""Watches whether the machine keeps up with the world, and logs it if not. Knows no robot."""

from __future__ import annotations

import logging
from collections.abc import Callable

log = logging.getLogger(__name__)
WINDOW = 5.0  # s of the clock per judgement
WORSE = 0.1  # of the wanted pace: the further loss that justifies another warning
CALM = 6  # windows without a loss after which it is over


class Pace:
    """Sum of the skipped robot time. ``speed``: the wanted pace, robot seconds per real second."""

    def __init__(self, speed: Callable[[], float]) -> None:
        self._speed = speed
        self._began: float | None = None  # start of the window
        self._lost = self._total = 0.0  # s lost in the window, and since the machine became too slow
        self._warned: float | None = None  # the share of the wanted pace in the last warning; None: no warning
        self._calm = 0

    def skip(self, seconds: float) -> None:
        """Note ``seconds`` of robot time that were not simulated."""
        self._lost += seconds
        self._total += seconds

    def look(self, now: float) -> None:
        """Judge the pace at the end of a window of the clock; cheap otherwise."""
        if self._began is None:
            self._began = now
        if now - self._began < WINDOW:
            return
        share, lost = max(0.0, 1.0 - self._lost / (now - self._began)), self._lost
        self._began, self._lost = now, 0.0
        if lost:
            self._slow(share, lost)
        elif self._warned is not None:
            self._recover()

    def _slow(self, share: float, lost: float) -> None:
        self._calm = 0
        if self._warned is not None and share > self._warned - WORSE:
            return
        how = "still slower" if self._warned is not None else "too slow for the world"
        self._warned = share
        log.warning(
            "this machine is %s: real-time factor %.2f of %g, %.1f s of robot time lost just now, %.1f s in all",
            how, share * self._speed(), self._speed(), lost, self._total,
        )  # fmt: skip

    def _recover(self) -> None:
        self._calm += 1
        if self._calm >= CALM:
            log.info(
                "this machine keeps up again: real-time factor %g; %.1f s of robot time were lost",
                self._speed(),
                self._total,
            )
            self._warned, self._total, self._calm = None, 0.0, 0
