"""The thresholds of driving to goals: distances in m, angles in rad, robot times in s."""

from __future__ import annotations

import math

from roboglot.model.components.motion.navigation import Tracks
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class PilotTuning:
    """Thresholds of patience, caution and precision of a drive. The defaults suit bodies of 0.2 to 0.35 m radius."""

    # Patience
    patience: float = 30.0  # without getting closer before giving up
    patience_on_tracks: float = 240.0  # … where the robot must not leave the tracks
    good_enough_seconds: float = 3.0  # without getting closer before the tolerance suffices
    progress: float = 0.1
    stuck_seconds: float = 3.0  # without getting closer while moving faster than stuck_speed (m/s)
    stuck_speed: float = 0.05
    waiting_gap: float = 0.4  # from an obstacle, within which standing counts as waiting for it

    # Planning
    replan_period: float = 0.5  # between two plans, at least
    wait_period: float = 2.0  # until the next plan when no route was found
    detour: float = 3.0  # a route longer than the blocked one by this is taken only after detour_after
    detour_after: float = 4.0
    others_after: float = 15.0  # … at most, where other robots stand in the way and will leave
    others_pace: float = 0.8  # m/s at which a detour around them is expected to be driven
    detours_max: int = 10  # per drive
    around: float = 0.5  # a route longer than the blocked one by this is a different route …
    arounds_max: int = 40  # … and is taken at most so often per drive
    at_goal: float = 1.0  # from the goal within which an obstacle may stand on it …
    at_goal_max: int = 6  # … and that many ways around it, in more than the patience's time, show that it does
    polite_period: float = 1.0  # between two plans around a robot that comes into the way
    stray: float = 0.4  # from the route at which it is planned again
    unknown_seam: float = 1.0  # of unknown floor on a route that count as known: the map has holes along its edges
    search_after: float = 10.0  # s of waiting for an obstacle on a known route before unknown floor is searched
    look_first: float = 2.0  # … before a much longer way, if nothing moves around
    search_share: float = 2.0  # times the first route, plus search_more: the longest drive through unknown floor
    search_more: float = 10.0

    # Looking ahead
    touch_margin: float = 0.015  # beyond the hull within which an obstacle is in the way
    slow_margin: float = 0.12  # … within which the robot slows down
    horizon: float = 3.0  # ahead that are compared with scans
    scan_age_max: float = 0.5  # scans older than this stop the robot

    # Knowing the place
    lost_quality: float = 0.2
    lost_seconds: float = 5.0
    vague: float = 0.5  # m: standard deviation of the place, or the tolerance, up to which a drive succeeds
    found_seconds: float = 15.0  # of standing still in which a lost pose may be recovered

    # Arriving
    there: float = 0.015  # where braking begins
    there_ahead: float = 0.03  # … for a base that only drives forward
    there_yaw: float = math.radians(0.5)
    good: float = 0.025  # required at standstill
    good_yaw: float = math.radians(1.0)
    corrections_max: int = 4
    corrections_ahead_max: int = 8
    hold_gain: float = 2.0  # 1/s: to keep the place while turning
    hold_speed: float = 0.1  # m/s

    report_period: float = 0.5

    def patience_for(self, tracks: Tracks) -> float:
        """Return the time without getting closer before a drive with these tracks gives up, s."""
        return self.patience_on_tracks if tracks is Tracks.STRICT else self.patience

    def there_for(self, tolerance: float, *, holonomic: bool) -> float:
        """Return the distance from the end at which to brake, m: a little more for a base that is not holonomic."""
        return self.there if holonomic else max(self.there, min(self.there_ahead, 0.6 * tolerance))

    def corrections_for(self, *, holonomic: bool) -> int:
        """Return the number of tries to settle on the goal: more for a base that is not holonomic."""
        return self.corrections_max if holonomic else self.corrections_ahead_max
