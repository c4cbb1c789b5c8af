"""Following a route: direction, speed and heading. A differential base drives in its heading.

Knows no obstacle.
"""

from __future__ import annotations

import math
from dataclasses import field

from roboglot.autonomy.navigation.route import Route
from roboglot.autonomy.navigation.speed_profile import APPROACH_GAIN, BRAKING_SHARE
from roboglot.model.components.motion.base import BaseLimits
from roboglot.model.geometry import Point, Pose, Twist, wrap_angle
from roboglot.values import dataclass

PERIOD = 0.04  # s between two commands
LOOKAHEAD, LOOKAHEAD_SECONDS = 0.12, 0.2  # m, and m per m/s, of look-ahead along the path
FINAL = 0.3  # m from the end: head straight for the goal and keep the heading
FINAL_SPEED = 0.5  # m/s within that distance
TURN_ON_SPOT = math.radians(60.0)  # heading error beyond which the robot turns before it drives
TURN_AHEAD = 0.4  # m along another route to where it leads first
TURN_AT_END = math.radians(15.0)  # for a differential base close to the goal
TURN_GAIN = 4.0  # 1/s
TURN_RATE = 2.0  # rad/s at most: scans smear in faster turns
REACTION = 0.1  # s until a scan or a command can take effect
SLOW = 0.35  # m/s past near obstacles
STOP_GAP = 0.05  # m kept from an obstacle on the path
STEP_MAX = 0.15  # m between two driven poses; a larger step is a correction of the estimated pose


@dataclass(slots=True)
class Follower:
    """Follower of one route at a time; its speed carries over to the next route."""

    limits: BaseLimits
    top: float  # m/s
    route: Route
    along: float = 0.0  # m along the route
    beside: float = 0.0  # m beside the route
    stop_at: float = math.inf  # m along the route where an obstacle is in the way
    slow_at: float = math.inf  # m along the route where an obstacle is passed closely
    speed: float = 0.0
    yaw_rate: float = 0.0
    _passed: int = field(default=0)
    _last: Point | None = field(default=None)
    _turning: bool = field(default=False)  # in place

    def take(self, route: Route) -> None:
        """Continue on another route."""
        self.route, self.along, self.beside, self._passed = route, 0.0, 0.0, 0
        self.stop_at = self.slow_at = math.inf

    @property
    def left(self) -> float:
        """Distance left on the route, m."""
        return max(0.0, self.route.length - self.along)

    @property
    def passed(self) -> int:
        """Number of goals reached on this route, without the last."""
        return self._passed

    @property
    def last(self) -> bool:
        """True if only the last goal is left."""
        return self._passed == len(self.route.goals) - 1

    @property
    def end(self) -> Point:
        """End of the route."""
        return self.route.end

    def locate(self, pose: Pose) -> None:
        """Update the place on the route, and count the goals reached since the last call."""
        here = pose.point
        driven = self._last is not None and self._last.distance_to(here) <= STEP_MAX
        before = self._last if self._last is not None and driven else here
        self._last = here
        goals, reaches = self.route.goals, self.route.reaches
        while not self.last and _nearest(before, here, goals[self._passed]) <= reaches[self._passed]:
            self._passed += 1
        self.along, self.beside = self.route.advance(pose, self._passed)

    def pass_goal(self) -> None:
        """Count the next goal as reached: the robot cannot get nearer."""
        self._passed += not self.last

    def carrot(self) -> tuple[Point, float]:
        """Return the point to aim for, at most the next goal, and its distance along the route, m."""
        goal_along = self.route.goals_along[self._passed]
        along = min(self.along + LOOKAHEAD + LOOKAHEAD_SECONDS * self.speed, goal_along)
        return self.route.point_at(along), along

    def command(self, pose: Pose) -> Twist:
        """Return the twist for the next period; call ``locate`` before."""
        carrot, _ = self.carrot()
        bearing = pose.point.bearing_to(carrot)
        braking = 2.0 * BRAKING_SHARE * self.limits.linear_acceleration
        reached = self.along + REACTION * self.speed
        allowed = math.sqrt(braking * max(0.0, self.stop_at - STOP_GAP - reached))
        allowed = min(allowed, math.sqrt(SLOW * SLOW + braking * max(0.0, self.slow_at - reached)))
        error = 0.0
        near = pose.distance_to(self.route.end)
        closing = self.last and self.left < FINAL
        if closing:
            allowed = min(allowed, self.top, FINAL_SPEED, self.route.ceiling_here)
            allowed = min(allowed, math.sqrt(braking * near), APPROACH_GAIN * near)
        else:
            allowed = min(allowed, self.route.speed_here)
        if not closing or not self.limits.holonomic:
            error = wrap_angle(bearing - pose.yaw)
            self._turning = abs(error) >= self._turn_on_spot(near)
            allowed *= 0.0 if self._turning else math.cos(error)
        step = self.limits.linear_acceleration * PERIOD
        speed = _towards(self.speed, allowed, step)
        self.speed = max(speed, self.speed - step)  # a base under way does not stop at once
        self.turn(error)
        if not self.limits.holonomic:
            return Twist(speed, 0.0, self.yaw_rate)
        aim = bearing - (pose.yaw + self.yaw_rate * PERIOD / 2.0)
        return Twist(speed * math.cos(aim), speed * math.sin(aim), self.yaw_rate)

    def _turn_on_spot(self, near: float) -> float:
        """Return the heading error (rad) beyond which the robot turns before it drives.

        A differential base aims more exactly near the end, and while it turns on the spot anyway.
        """
        if self.limits.holonomic:
            return TURN_ON_SPOT
        return TURN_AT_END if near < FINAL or self._turning else TURN_ON_SPOT

    def turn(self, error: float) -> float:
        """Return the yaw rate (rad/s) for the next period that reduces the heading ``error`` (rad)."""
        braking = math.sqrt(2.0 * BRAKING_SHARE * self.limits.angular_acceleration * abs(error))
        wanted = min(TURN_RATE, self.limits.twist.yaw, braking, TURN_GAIN * abs(error))
        step = self.limits.angular_acceleration * PERIOD
        self.yaw_rate = _towards(self.yaw_rate, math.copysign(wanted, error), step)
        return self.yaw_rate

    def turning(self, pose: Pose, route: Route) -> float:
        """Return the time that turning on the spot into ``route`` takes longer than going on, s."""
        ahead = route.point_at(min(TURN_AHEAD, route.length))
        now, then = (abs(wrap_angle(pose.point.bearing_to(at) - pose.yaw)) for at in (self.carrot()[0], ahead))
        if then <= max(now, TURN_ON_SPOT):
            return 0.0
        return (then - now) / min(TURN_RATE, self.limits.twist.yaw) + self.speed / self.limits.linear_acceleration

    def halt(self) -> None:
        """Note that the base was stopped by others."""
        self.speed = self.yaw_rate = 0.0


def _nearest(start: Point, end: Point, goal: Point) -> float:
    """Return the distance from ``goal`` to the line from ``start`` to ``end``, m."""
    dx, dy = end.x - start.x, end.y - start.y
    length = dx * dx + dy * dy
    share = ((goal.x - start.x) * dx + (goal.y - start.y) * dy) / length if length else 0.0
    share = min(1.0, max(0.0, share))
    return math.hypot(goal.x - start.x - share * dx, goal.y - start.y - share * dy)


def _towards(now: float, goal: float, by: float) -> float:
    """Return ``now`` moved to ``goal`` by at most ``by``; slowing down is unlimited here, but limited by the base."""
    return goal if abs(goal) < abs(now) else now + max(-by, min(by, goal - now))
