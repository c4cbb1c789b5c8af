"""Watches whether the machine keeps up with the world, and logs it if not. Knows no robot."""

from __future__ import annotations

import logging
from collections.abc import Callable

log = logging.getLogger(__name__)
WINDOW = 5.0  # s of asked robot time per judgement
FULL = 0.95  # of the wanted pace: less is too slow
WORSE = 0.1  # of the wanted pace: the further loss that justifies another warning
CALM = 6  # windows without a loss after which it is over


class Pace:
    """Pace of robot time. ``speed``: the wanted one, robot seconds per real second; ``skips``: lost time is skipped."""

    def __init__(self, speed: Callable[[], float], *, skips: bool) -> None:
        self._speed = speed
        self._lost_by = "%.1f s of robot time skipped" if skips else "robot time fell behind by %.1f s"
        self._window: tuple[float, float] | None = None  # simulated and lost time at its start
        self._full = 0.0  # s lost before the machine became too slow
        self._warned: float | None = None  # the share of the wanted pace in the last warning; None: no warning
        self._calm = 0

    def look(self, simulated: float, lost: float) -> None:
        """Judge the pace at the end of a window, by the robot s that were ``simulated`` and ``lost`` until now."""
        if self._window is None:
            self._window = simulated, lost
        done, missed = simulated - self._window[0], lost - self._window[1]
        if done + missed < WINDOW:
            return
        self._window = simulated, lost
        if (share := max(0.0, done / (done + missed))) < FULL:
            self._slow(share, missed, lost)
        elif self._warned is not None:
            self._recover(lost)
        else:
            self._full = lost

    def _slow(self, share: float, missed: float, lost: float) -> None:
        self._calm = 0
        if self._warned is not None and share > self._warned - WORSE:
            return
        how = "still slower" if self._warned is not None else "too slow for the world"
        self._warned = share
        log.warning(
            f"this machine is %s: real-time factor %.2f of %g, {self._lost_by} just now, %.1f s in all",
            how, share * self._speed(), self._speed(), missed, lost - self._full,
        )  # fmt: skip

    def _recover(self, lost: float) -> None:
        self._calm += 1
        if self._calm >= CALM:
            log.info(
                f"this machine keeps up again: real-time factor %g; {self._lost_by} in all",
                self._speed(),
                lost - self._full,
            )
            self._warned, self._full, self._calm = None, lost, 0
