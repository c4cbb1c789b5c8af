"""Whether a robot that was found still stands there: it may be carried or pushed on while the search looks at a scan.

Needs the kernels, hence is imported only when they are loaded.
"""

from __future__ import annotations

import math

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.matcher import FREE, PLACE_AGREEMENT, WIDE, Match, fit, search
from roboglot.autonomy.slam.slam import Slam
from roboglot.model.clock import Clock
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import wrap_angle

SETTLE_SECONDS = 5.0  # that newer scans may take to agree
PERIOD = 0.05  # s between two looks for a newer scan
SETTLED, SETTLED_YAW = 0.02, math.radians(1.0)  # m, rad between two scans of a robot that stands where it was found


async def settle(clock: Clock, estimator: Slam, belief: Belief) -> bool:
    """Believe what newer scans say around the found place, until one confirms it; False if they do not fit there."""
    end, seen = clock.time() + SETTLE_SECONDS, estimator.newest
    while clock.time() < end:
        await clock.sleep(PERIOD)
        newest = estimator.newest
        if newest is None or newest is seen:
            continue
        seen, expected = newest, belief.map_to_odom.compose(newest.odometry)
        found = _matched(belief, newest)
        if found is None:
            return False
        estimator.believe(found, newest.odometry)
        off, turned = found.pose.distance_to(expected), abs(wrap_angle(found.pose.yaw - expected.yaw))
        if off < SETTLED and turned < SETTLED_YAW:
            return True
    return False


def _matched(belief: Belief, newest: ScanTaken) -> Match | None:
    """Where the scan fits around the believed place; None if it does not."""
    scan, expected = belief.reader.read(newest.scan), belief.map_to_odom.compose(newest.odometry)
    start = search(belief.map, scan, expected, WIDE)
    found = max((fit(belief.map, scan, pose, FREE) for pose in (expected, start)), key=lambda match: match.fit)
    return found if found.agreement >= PLACE_AGREEMENT else None
