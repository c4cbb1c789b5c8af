"""Watches whether the pose in the map is known: reports its loss with a reason, and its recovery."""

from __future__ import annotations

import math
from collections.abc import Sequence

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.certainty import Support
from roboglot.autonomy.slam.matcher import Match
from roboglot.autonomy.slam.recovery.distant_places import NEAR
from roboglot.model.events import (
    EventStream,
    LocalizationLost,
    LocalizationRecovered,
    LostReason,
    PoseConfirmed,
    RecoveryMeans,
)
from roboglot.model.geometry import Pose

DENIED_AGREEMENT, DENIED_SHARE = 0.5, 0.3  # contradiction by the map: agreement below, share of points above
DENIED_HIDDEN = 0.2  # … or share of rays through walls, which no crowd explains
GOOD_AGREEMENT, GOOD_SHARE = 0.8, 0.6  # confirmation by the map
DOUBTS_MAX, DOUBT_SECONDS = 3, 1.5  # contradictions in a row, and their duration, before the pose is lost
POOR_AGREEMENT, POOR_SECONDS = 0.7, 5.0  # after a contradiction, a fit that stays below for so long: the pose is lost
CONFIRMED = 5  # confirmations in a row before the pose is known again
BLIND_SECONDS, BLIND_INTERVALS = 2.0, 5.0  # s without a scan, and in usual intervals, from which the pose is uncertain
INTERVAL_GAIN = 0.1


class Whereabouts:
    """Watch over the map's support for every matched scan; sets ``belief.lost``."""

    def __init__(self, belief: Belief, events: EventStream) -> None:
        self._belief, self._events = belief, events
        self._interval = math.inf  # s that usually pass between two scans
        self._heard_at = -math.inf
        self._doubts = self._good = 0
        self._doubted_at = self._lost_at = math.inf
        self._poor_since = math.inf  # s: since when scans fit poorly, from a contradiction on
        self._given_at = -math.inf  # s: since when a pose is unconfirmed, set by a client or found after a displacement
        self._elsewhere = False  # whether a search found several places, none of them near the believed one
        self.sure = True  # whether scans may be added to the map

    def note_scan(self, stamp: float) -> bool:
        """Note a scan; return whether the silence before it was long enough to move the robot unnoticed."""
        gap, self._heard_at = stamp - self._heard_at, stamp
        if not math.isfinite(gap) or gap <= 0.0:
            return False
        blind = self._is_blind(gap)
        if not blind:
            usual = gap if math.isinf(self._interval) else self._interval
            self._interval = usual + INTERVAL_GAIN * (gap - usual)
        return blind

    def check_silence(self, now: float) -> None:
        """Report a loss of the pose if the lidar has been silent for too long."""
        if self._belief.localizing and self._belief.map.scans and self._is_blind(now - self._heard_at):
            self.lose(LostReason.NO_SCANS, now)

    def _is_blind(self, gap: float) -> bool:
        return math.isfinite(gap) and gap > max(BLIND_SECONDS, BLIND_INTERVALS * self._interval)

    def judge(self, support: Support, stamp: float) -> None:
        """Update doubt and confirmation by the map's support for a scan at the believed pose."""
        judged = support.fitting + support.hidden + support.floating
        denied = support.hidden >= DENIED_HIDDEN * support.points or (
            support.agreement < DENIED_AGREEMENT and judged >= DENIED_SHARE * support.points
        )
        good = support.agreement >= GOOD_AGREEMENT and support.fitting >= GOOD_SHARE * support.points
        self._good = self._good + 1 if good else 0
        self._belief.denied = denied
        if denied:
            self._doubted_at, self._poor_since = min(self._doubted_at, stamp), min(self._poor_since, stamp)
            self._doubts += 1
            self.sure = False
            if self._doubts >= DOUBTS_MAX and stamp - self._doubted_at >= DOUBT_SECONDS:
                ambiguous = self._belief.lost is LostReason.AMBIGUOUS
                self.lose(LostReason.AMBIGUOUS if ambiguous else LostReason.NO_FIT, stamp)
            return
        self._doubts, self._doubted_at = 0, math.inf
        new_ground = judged < DENIED_SHARE * support.points
        if new_ground or support.agreement >= POOR_AGREEMENT:
            self._poor_since = math.inf
        self._belief.denied = math.isfinite(self._poor_since)
        if self._good >= CONFIRMED and not self._belief.confirmed:
            self._belief.confirmed = True
            self._events.publish(PoseConfirmed(stamp=stamp, pose=self._belief.pose))
        if self._belief.lost is not None:
            self._look_again(stamp, good=good, new_ground=new_ground)
        elif not self._belief.confirmed and stamp - self._given_at >= DOUBT_SECONDS:
            self.lose(LostReason.NO_GROUND if new_ground else LostReason.NO_FIT, stamp)
        elif stamp - self._poor_since >= POOR_SECONDS:
            self.lose(LostReason.NO_FIT, stamp)
        elif not self.sure and self._belief.confirmed and (new_ground or self._good >= CONFIRMED):
            self.sure = True

    def _look_again(self, stamp: float, *, good: bool, new_ground: bool) -> None:
        """End the loss once scans confirm the pose; replace NO_SCANS as its reason, as the lidar is back."""
        if self._good >= CONFIRMED and not self._elsewhere:
            self.find(RecoveryMeans.NEARBY, stamp)
        elif self._belief.lost is LostReason.NO_SCANS and not good:
            self._belief.lost = LostReason.NO_GROUND if new_ground else LostReason.NO_FIT

    def lose(self, reason: LostReason, stamp: float) -> None:
        """Note that the pose is lost; publish it once until it is found."""
        first, self._belief.lost, self.sure = self._belief.lost is None, reason, False
        if first:
            self._lost_at, self._good = stamp, 0
            self._events.publish(LocalizationLost(stamp=stamp, reason=reason, quality=self._belief.quality))

    def be_ambiguous(self, found: Sequence[Match], believed: Pose) -> None:
        """Note that the scan may be from several places; if none is near the ``believed`` one, a search ends that."""
        self._belief.lost = LostReason.AMBIGUOUS
        self._elsewhere = all(match.pose.distance_to(believed) >= NEAR for match in found)

    def forget_places(self) -> None:
        """Forget the places that the last search found, as a newer one has ended."""
        self._elsewhere = False
        if self._belief.lost is LostReason.AMBIGUOUS:
            self._belief.lost = LostReason.NO_FIT

    def find(self, means: RecoveryMeans, stamp: float) -> None:
        """Note that the pose is known; scans are added to the map after further confirmations."""
        belief = self._belief
        self._doubts, belief.confirmed, self._elsewhere = 0, True, False
        self._doubted_at = self._poor_since = math.inf
        if belief.lost is None:
            return
        belief.lost, self._good = None, 0
        seconds = max(0.0, stamp - self._lost_at)
        self._events.publish(LocalizationRecovered(stamp=stamp, means=means, pose=belief.pose, seconds=seconds))

    def note_given(self, stamp: float) -> None:
        """Note a pose given by a client, which scans have to confirm before any is added to the map."""
        self.find(RecoveryMeans.GIVEN, stamp)
        self.be_displaced(stamp)

    def be_displaced(self, stamp: float) -> None:
        """Note a displacement: scans have to confirm the pose."""
        self._given_at, self._good, self.sure, self._belief.confirmed = stamp, 0, False, False

    def begin(self) -> None:
        """Begin a new map, whose first scan defines the pose."""
        self._doubts, self.sure, self._belief.confirmed = 0, True, True
        self._doubted_at = self._poor_since = math.inf
        self._elsewhere = False
