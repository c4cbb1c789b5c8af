"""Computing time of a program's process. Lockstep time stands still meanwhile, so the machine's speed has no effect."""

from __future__ import annotations

from roboglot.model.clock import Clock


class ProcessTime:
    """Computing time of one run: between ``begin`` and ``end`` the clock is held unless the process waits."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._asks = self._stopped = False
        self._over = True

    def begin(self) -> None:
        """Note that the process starts."""
        self._over = False
        self._look()

    def ask(self, waiting: bool) -> None:
        """Note that the process starts or stops waiting for the answer to a call."""
        self._asks = waiting
        self._look()

    def stop(self, stopped: bool) -> None:
        """Note that the process is suspended or resumed."""
        self._stopped = stopped
        self._look()

    def end(self) -> None:
        """Note that the process is gone and its end is recorded."""
        self._over = True
        self._look()

    def _look(self) -> None:
        if self._over or self._asks or self._stopped:
            self._clock.release(self)
        else:
            self._clock.hold(self)
