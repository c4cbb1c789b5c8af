"""Does a world's ticks when they are due, and logs if the machine does not keep up. Knows no robot."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator
from functools import partial

from roboglot.model.clock import Clock, PatientClock, RealClock, Timer

log = logging.getLogger(__name__)
BEHIND_MAX = 25  # ticks by which a slow machine may lag before time is skipped, if the clock does not wait
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


class Beat:
    """Ticks of a world on its clock. ``ticks``: number of those done; ``origin``: robot time of the first, s."""

    def __init__(
        self, clock: Clock, seconds: float, tick: Callable[[], Iterator[None]], rest: Callable[[], int]
    ) -> None:
        """``seconds``: length of a tick; ``tick`` does one or more in steps; ``rest``: how many may wait after it."""
        self._clock, self._seconds, self._tick, self._rest = clock, seconds, tick, rest
        self.ticks, self.origin = 0, 0.0
        self._resting = 0  # ticks before the timer's that need not be done one by one
        self._timer: Timer | None = None
        speed = lambda: clock.speed if isinstance(clock, RealClock) else 1.0  # noqa: E731
        self._pace = Pace(speed, skips=not isinstance(clock, PatientClock))

    @property
    def time(self) -> float:
        """Robot time of the last tick, s."""
        return self.origin + self.ticks * self._seconds

    @property
    def simulated(self) -> float:
        """Robot time simulated since the start, s: less than the clock's on a machine that is too slow.

        Time that passes while robots rest counts.
        """
        rested = min(self._clock.time() - self.time, self._resting * self._seconds) if self._resting else 0.0
        return self.ticks * self._seconds + max(0.0, rested)

    def start(self) -> None:
        """Let time pass; needs the running loop."""
        if self._timer is None:
            self.origin = self._clock.time() - self.simulated
            self._clock.reached(self.time)
            self._arm()

    def close(self) -> None:
        """Stop."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer, self._resting = None, 0
            self._clock.reached(math.inf)

    def fitting(self, until: float, first: int, most: int) -> int:
        """Return how many ticks from the ``first`` on, 1 to ``most``, end by the time ``until``."""
        while most > 1 and self.origin + (first + most - 1) * self._seconds > until:
            most -= 1
        return most

    def end_rest(self) -> int:
        """Have the next tick done when it is due; return the number of those that have passed and are still to do."""
        if self._timer is None or not self._resting:
            return 0
        passed = max(0, min(self._due(), self._resting))
        self._timer.cancel()
        self._arm(after=passed)
        return passed

    def _due(self) -> int:
        return int((self._clock.time() - self.origin) / self._seconds + 1e-6) - self.ticks

    def _arm(self, *, resting: int = 0, after: int = 0) -> None:
        """Set the timer for the next tick ``after`` some, of which ``resting`` wait."""
        self._resting = resting
        self._timer = self._clock.call_at(self.origin + (self.ticks + resting + after + 1) * self._seconds, self._beat)

    def _beat(self) -> None:
        self._clock.in_turn(partial(self._advance, self._timer), first=True)

    def _advance(self, fired: Timer | None) -> None:
        """Do a tick that is due; other tasks get their turn before the next one, even if it is due as well.

        On a machine that is too slow, a patient clock waits; beside real robots, whose time does not, time is skipped.
        """
        if self._timer is None or self._timer is not fired:
            return  # closed, and perhaps started again
        self._resting = 0
        due = self._due()
        if due > BEHIND_MAX:
            self.origin += (due - 1) * self._seconds
            self._clock.behind += (due - 1) * self._seconds
            due = 1
        self._pace.look(self.simulated, self._clock.behind)
        self._clock.in_steps(self._steps(due > 0, fired))

    def _steps(self, due: bool, fired: Timer) -> Iterator[None]:
        """Do the steps of a tick, if it is ``due``, and schedule the next one."""
        resting = 0
        if due:
            for _ in self._tick():
                yield
                if self._timer is not fired:
                    return  # closed meanwhile, and perhaps started again, with a beat of its own
            resting = self._rest()
        self._clock.reached(self.time + resting * self._seconds)
        self._arm(resting=resting)
