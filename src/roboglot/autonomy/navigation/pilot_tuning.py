"""The thresholds of driving to goals: distances in m, angles in rad, times in s of the robot."""

from __future__ import annotations

import math
from dataclasses import dataclass

from roboglot.model.components.motion.navigation import Tracks


@dataclass(frozen=True, slots=True)
class PilotTuning:
    """Thresholds of patience, caution and precision of a drive. The defaults suit bodies of 0.2 to 0.35 m radius."""

    # Patience
    patience: float = 30.0  # without getting closer before it gives up
    patience_on_tracks: float = 240.0  # … where it must not leave the tracks
    good_enough_seconds: float = 3.0  # without getting closer after which the tolerance is enough
    progress: float = 0.1
    stuck_seconds: float = 3.0  # without getting closer at more than stuck_speed (m/s)
    stuck_speed: float = 0.05
    waiting_gap: float = 0.4  # from what blocks the way that count as waiting for it

    # Planning
    replan_period: float = 0.5  # between two plans at least
    wait_period: float = 2.0  # until the next plan when there was no way
    detour: float = 3.0  # a way so much longer than the blocked one is taken only after detour_after
    detour_after: float = 4.0
    others_after: float = 15.0  # … at most, where others stand in it that will leave
    others_pace: float = 0.8  # m/s at which it would go around them meanwhile
    detours_max: int = 10  # in one drive
    around: float = 0.5  # a way so much longer than the blocked one is another way …
    arounds_max: int = 40  # … and taken so often in one drive
    polite_period: float = 1.0  # between two plans around another one that comes into the way
    stray: float = 0.4  # beside the route at which it plans anew
    unknown_seam: float = 1.0  # of unknown floor on a way that count as known: the map has holes along its edges
    search_after: float = 10.0  # s of waiting for what stands on a known way before unknown floor is searched
    search_share: float = 2.0  # times the first way, and search_more: driven at most through unknown floor
    search_more: float = 10.0

    # Looking ahead
    touch_margin: float = 0.015  # beyond the hull within which something is in the way
    slow_margin: float = 0.12  # … makes it slow
    horizon: float = 3.0  # ahead that scans are compared with
    scan_age_max: float = 0.5  # it does not drive on older scans

    # Knowing the place
    lost_quality: float = 0.2
    lost_seconds: float = 5.0
    found_seconds: float = 15.0  # of standing still in which a lost place may be found again

    # Arriving
    there: float = 0.015  # where it brakes
    there_ahead: float = 0.03  # … for one that only drives ahead
    there_yaw: float = math.radians(0.5)
    good: float = 0.025  # what it must have when it stands
    good_yaw: float = math.radians(1.0)
    corrections_max: int = 4
    corrections_ahead_max: int = 8
    hold_gain: float = 2.0  # 1/s: keeping the place while turning
    hold_speed: float = 0.1  # m/s

    report_period: float = 0.5

    def patience_for(self, tracks: Tracks) -> float:
        """Seconds without getting closer before a drive with these tracks gives up."""
        return self.patience_on_tracks if tracks is Tracks.STRICT else self.patience

    def there_for(self, tolerance: float, *, holonomic: bool) -> float:
        """Metres from the end where a base brakes: one that cannot correct sideways does so a little earlier."""
        return self.there if holonomic else max(self.there, min(self.there_ahead, 0.6 * tolerance))

    def corrections_for(self, *, holonomic: bool) -> int:
        """Return how often it drives to the end anew: a base that cannot correct sideways tries more often."""
        return self.corrections_max if holonomic else self.corrections_ahead_max
