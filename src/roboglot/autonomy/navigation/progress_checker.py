"""Checks the progress of a drive, which ends without any, with slipping wheels, or when the robot is lost."""

from __future__ import annotations

import math

from roboglot.autonomy.navigation.follower import Follower
from roboglot.autonomy.navigation.pilot_tuning import PilotTuning
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.displacement import fresh_look
from roboglot.model.clock import Clock
from roboglot.model.errors import Blocked, NotLocalized

LOOK = 0.1  # s between two looks at whether the place is certain


class ProgressChecker:
    """Checker of one drive, updated at every step; ``seconds``: allowed time without getting closer."""

    def __init__(self, clock: Clock, belief: Belief, tuning: PilotTuning, seconds: float) -> None:
        self._clock, self._belief, self._tuning = clock, belief, tuning
        self.seconds = seconds
        self._closest, self._closest_at = math.inf, clock.time()
        self._free_at, self._lost_at = clock.time(), math.inf

    def restart(self) -> None:
        """Restart after a hold: the time until now does not count."""
        self._closest_at = self._free_at = self._clock.time()

    def take(self, left: float) -> None:
        """Note another route with ``left`` m to drive; the change alone is not progress."""
        self._closest = left

    @property
    def stood(self) -> float:
        """Time without getting closer, s."""
        return self._clock.time() - self._closest_at

    @property
    def spent(self) -> bool:
        """True if the drive got no closer for too long."""
        return self.stood > self.seconds

    def check_place(self) -> None:
        """Raise NotLocalized if the robot has been lost for too long."""
        belief, tuning, now = self._belief, self._tuning, self._clock.time()
        lost = belief.localizing and (belief.lost is not None or belief.quality < tuning.lost_quality)
        self._lost_at = min(self._lost_at, now) if lost else math.inf
        if now - self._lost_at > (tuning.lost_seconds if belief.lost is None else tuning.found_seconds):
            why = belief.lost or "the scans do not fit the map"
            raise NotLocalized(f"{why} (quality {belief.quality:.2f})")

    async def be_certain(self, tolerance: float) -> None:
        """Wait until the pose is certain, while the robot stands.

        Raises NotLocalized after a timeout, or if the scans leave more room than the ``tolerance`` (m) and some slack.
        """
        belief, begun = self._belief, self._clock.time()
        await fresh_look(self._clock, belief)
        while not belief.is_certain:
            self.check_place()
            if self._clock.time() - begun > self._tuning.found_seconds:
                why = "the scans do not confirm the place"
                raise NotLocalized(f"{why} (quality {belief.quality:.2f})")
            await self._clock.sleep(LOOK)
        if belief.localizing and belief.sigma > max(tolerance, self._tuning.vague):
            raise NotLocalized(
                f"scans do not show the place, as along a bare corridor: it may be {belief.sigma:.1f} m off"
            )

    def look(self, follower: Follower) -> bool:
        """Note the distance left; return whether it shrank. Raises Blocked if the wheels slip."""
        now, tuning = self._clock.time(), self._tuning
        closer = follower.left < self._closest - tuning.progress
        if closer:
            self._closest, self._closest_at = follower.left, now
        if closer or follower.speed < tuning.stuck_speed:
            self._free_at = now
        elif now - self._free_at > tuning.stuck_seconds:
            raise Blocked("the wheels turn, but something that the lidar does not see holds the robot")
        return closer
