"""Detects motion of the robot by anything but its wheels, from the scans' poses against odometry's.

Odometry's own errors grow with the distance and are in the prior of each match; a shove is larger, and sudden.
"""

from __future__ import annotations

import math
from collections import deque
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.belief import Belief
from roboglot.model.clock import Clock
from roboglot.model.errors import Blocked, NotLocalized
from roboglot.model.events import Event, LocalizationLost, LoopClosed, LostReason, PoseJumped, RobotDisplaced
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot

WINDOW = 1.0  # s that a displacement takes
SHOVED, SHOVED_PER_METRE = 0.05, 0.05  # m, and m per m driven, of odometry error beyond which the robot was displaced
SIGMAS = 3.0  # standard deviations of the prior that explain a correction
QUIET = 1.0  # s after a pose was set in which corrections are ignored
LOOK = 0.02  # s between two looks at what scans say
LOOK_MAX = 0.5  # s to wait for a scan
RESOLVED_MAX = 3.0  # s in which a place that a scan denied is confirmed, lost or found elsewhere


class DisplacementWatch:
    """Watch over the corrections of all trusted matches."""

    def __init__(self) -> None:
        # stamp; x, y in map; x, y driven by odometry in map; m, the prior's standard deviation
        self._corrections: deque[tuple[float, float, float, float, float, float]] = deque()
        self.slips = False  # whether wheel slip explains the newest displacement
        self._quiet_until = -math.inf

    def forget(self, stamp: float) -> None:
        """Forget past corrections, and ignore the next ones: the pose was set, or is in doubt."""
        self._corrections.clear()
        self._quiet_until = stamp + QUIET

    def check(self, stamp: float, before: Pose, seen: Pose, prior: NDArray[np.float64], step: Pose) -> float | None:
        """Return a recent displacement (m), once; None: there was none.

        ``before``: pose by odometry, ``seen``: by the scan (map); ``prior``: covariance before the match; ``step``:
        driven since the last one by odometry, in base_link at that time.
        """
        if stamp < self._quiet_until:
            return None
        corrections = self._corrections
        while corrections and stamp - corrections[0][0] > WINDOW:
            corrections.popleft()
        sigma = math.sqrt(float(prior[0, 0] + prior[1, 1]))
        heading = before.yaw - step.yaw
        cos, sin = math.cos(heading), math.sin(heading)
        ahead, aside = cos * step.x - sin * step.y, sin * step.x + cos * step.y
        corrections.append((stamp, seen.x - before.x, seen.y - before.y, ahead, aside, sigma))
        x = y = ahead = aside = driven = widest = 0.0
        for _, along, up, east, north, sigma in corrections:
            x, y, ahead, aside = x + along, y + up, ahead + east, aside + north
            driven, widest = driven + math.hypot(east, north), max(widest, sigma)
        shoved, slack = math.hypot(x, y), SHOVED + SHOVED_PER_METRE * driven + SIGMAS * widest
        if shoved <= slack:
            return None
        way = math.hypot(ahead, aside)
        lag, off = (-(x * ahead + y * aside) / way, abs(x * aside - y * ahead) / way) if way > 0.0 else (0.0, shoved)
        short = 0.0 < lag <= way + slack and off <= slack  # it fell short of the way that its wheels measured
        self.slips = short and self._back(ahead / way, aside / way) <= SHOVED
        self.forget(stamp)
        return shoved

    def _back(self, x: float, y: float) -> float:
        """Return how far the scans saw the robot go against the driven direction ``x``, ``y`` up to now, m."""
        back = 0.0
        for _, along, up, east, north, _ in self._corrections:
            back = max(0.0, back - (along + east) * x - (up + north) * y)
        return back


async def fresh_look(clock: Clock, belief: Belief) -> None:
    """Return once a scan begun from now on has been compared with the map, or none comes."""
    begun = clock.time()
    if not belief.localizing or not math.isfinite(belief.compared_at):
        return
    belief.asked = True
    while belief.compared_at <= begun and clock.time() - begun < LOOK_MAX:
        await clock.sleep(LOOK)


class Carried:
    """Watch over one short move, which goes by odometry alone, as a context; ``belief`` is None without a map."""

    def __init__(self, robot: Robot, belief: Belief | None) -> None:
        self._robot, self._belief = robot, belief
        self._knew = belief is not None and belief.localizing and belief.is_certain
        self._shoved, self._strayed, self._closed_at = 0.0, False, -math.inf
        self._slipped = belief.slipped if belief is not None else 0.0

    def __enter__(self) -> Self:
        kinds = RobotDisplaced, LocalizationLost, LoopClosed, PoseJumped
        self._stops = [self._robot.events.listen(kind, self._on_event) for kind in kinds]
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        for stop in self._stops:
            stop()

    def _on_event(self, event: Event) -> None:
        match event:
            case RobotDisplaced():
                self._shoved += event.distance
            case LocalizationLost():
                self._strayed |= event.reason is LostReason.NO_FIT
            case LoopClosed():
                self._closed_at = event.stamp
            case PoseJumped():  # the place was found elsewhere; no news if it was in doubt, set, or straightened
                self._knew &= not event.given
                self._strayed |= self._knew and event.stamp != self._closed_at
            case _:
                pass

    async def check(self) -> None:
        """Compare a newer scan with the map. Raises Blocked, NotLocalized if the robot was moved."""
        if self._belief is not None and self._knew:
            await fresh_look(self._robot.clock, self._belief)
            deadline = self._robot.clock.time() + RESOLVED_MAX
            while self._belief.denied and not self._strayed and self._robot.clock.time() < deadline:
                await self._robot.clock.sleep(LOOK)
            self._strayed |= self._belief.denied
        if self._strayed:
            raise NotLocalized("the scans no longer fit the map: something may have moved the robot")
        if self._belief is not None and self._belief.slipped > self._slipped:
            raise Blocked("the wheels slip: the robot did not get as far as its odometry says")
        if self._shoved:
            raise Blocked(f"something displaced the robot by {self._shoved:.2f} m")
