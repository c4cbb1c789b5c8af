"""Four feet that step: planted ones keep their places in the world, the others swing to their next foothold.

Kinematic: base_link is moved by others; the feet follow, and may hold it back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from roboglot.model.components.motion.feet import Foot, FootState
from roboglot.model.geometry import STILL, Point, Pose, Twist, Vector3
from roboglot.simulation.bodies.footfalls import DOWN, Swing, Swings

LOWERING = 0.5  # m/s at which a raised foot is lowered
HOME = 0.01  # m from its place at which a foot is at rest


class Feet:
    """Places of one body's feet in the world frame, as plain numbers for speed."""

    def __init__(self, homes: Sequence[Point], reach: float, pose: Pose) -> None:
        self._below_hips = self._homes = [(home.x, home.y) for home in homes]
        self._reach = reach
        self._hanging = False
        self._places = [_there(pose, *home) for home in self._homes]
        self._heights = [0.0] * len(homes)
        self._starts: list[tuple[float, float, float] | None] = [None] * len(homes)  # start and height of each swing
        self._last: list[Swing | None] = [None] * len(homes)
        self.restless = False  # whether a foot is away from its place or in the air

    def states(self, pose: Pose) -> Mapping[Foot, FootState]:
        """Return the state of each foot in base_link, which is at ``pose`` (world)."""
        states = {}
        for index, foot in enumerate(Foot):
            grounded = not self._hanging and self._starts[index] is None and self._heights[index] <= 0.0
            x, y = _seen(pose, *self._places[index])
            states[foot] = FootState(Vector3(x, y, self._heights[index]), grounded)
        return states

    def narrow(self, inward: float) -> None:
        """Set the feet's places ``inward`` m nearer to the body's middle than below the hips."""
        self._homes = [(x, y - math.copysign(inward, y)) for x, y in self._below_hips]

    def hang(self, pose: Pose) -> None:
        """Let the feet hang: the robot is in the air, held up or on its side."""
        self._hanging = self.restless = True
        self._places = [_there(pose, *home) for home in self._homes]
        self._heights = [0.0] * len(self._homes)
        self._starts = [None] * len(self._homes)

    def holds_back(self, pose: Pose, twist: Twist, swings: Swings) -> bool:
        """True if ``twist`` (base_link) would stretch a standing leg beyond its reach."""
        if twist == STILL:
            return False
        for index, (home_x, home_y) in enumerate(self._homes):
            if swings[index] is None and self._starts[index] is None:
                x, y = _seen(pose, *self._places[index])
                off_x, off_y = x - home_x, y - home_y
                away = off_x * (twist.x - twist.yaw * y) + off_y * (twist.y + twist.yaw * x)
                if away < 0.0 and math.hypot(off_x, off_y) >= self._reach:
                    return True
        return False

    def step(self, pose: Pose, twist: Twist, swings: Swings, seconds: float) -> None:
        """Move the feet for ``seconds``: base_link is at ``pose`` with ``twist``; a swing of None: the foot stands."""
        self._hanging = False
        if swings is DOWN and not self.restless and twist == STILL and self._near(pose):
            return
        self.restless = False
        for index, swing in enumerate(swings):
            if swing is not None:
                self._swing(index, swing, pose, twist)
                self.restless = True
            elif self._lowers(index, seconds) or self._stand(index, pose, twist) > HOME:
                self.restless = True

    def _lowers(self, index: int, seconds: float) -> bool:
        """Lower a foot that was kept up; return whether it is still on its way down."""
        last = self._last[index]
        if last is None or last.left != math.inf or self._heights[index] <= max(0.0, last.to.z):
            return False
        self._heights[index] = max(0.0, last.to.z, self._heights[index] - LOWERING * seconds)
        return True

    def _near(self, pose: Pose) -> bool:
        """Return whether the feet are at their places; two diagonal ones suffice, as a moved body moves all."""
        return self._off(0, pose) <= HOME and self._off(3, pose) <= HOME

    def _off(self, index: int, pose: Pose) -> float:
        x, y = _seen(pose, *self._places[index])
        return math.hypot(x - self._homes[index][0], y - self._homes[index][1])

    def _stand(self, index: int, pose: Pose, twist: Twist) -> float:
        """Land a foot, or drag it along with a body beyond its reach; return its distance from its place, m."""
        last = self._last[index]
        if self._starts[index] is not None and last is not None:
            self._places[index] = self._foothold(index, last, 0.0, pose, twist)
            self._heights[index] = max(0.0, last.to.z)
        self._starts[index] = self._last[index] = None
        off = self._off(index, pose)
        if off > self._reach:
            (home_x, home_y), (x, y) = self._homes[index], _seen(pose, *self._places[index])
            share = self._reach / off
            self._places[index] = _there(pose, home_x + (x - home_x) * share, home_y + (y - home_y) * share)
        return off

    def _swing(self, index: int, swing: Swing, pose: Pose, twist: Twist) -> None:
        start = self._starts[index]
        if start is None:
            start = self._starts[index] = (*self._places[index], self._heights[index])
        self._last[index] = swing
        (x, y, height), share = start, swing.share
        goal_x, goal_y = self._foothold(index, swing, 0.0 if swing.left == math.inf else swing.left, pose, twist)
        self._places[index] = (x + (goal_x - x) * share, y + (goal_y - y) * share)
        end = max(0.0, swing.to.z)
        self._heights[index] = height + (end - height) * share + swing.to.lift * swing.rise

    def _foothold(self, index: int, swing: Swing, left: float, pose: Pose, twist: Twist) -> tuple[float, float]:
        """Return the landing place (world): ahead of the foot's place by half of the body's way during the stand."""
        (home_x, home_y), half = self._homes[index], swing.stand / 2
        x = home_x + swing.to.x + (twist.x - twist.yaw * home_y) * half
        y = home_y + swing.to.y + (twist.y + twist.yaw * home_x) * half
        if not left:
            return _there(pose, x, y)
        turn = twist.yaw * left
        c, s = math.cos(turn), math.sin(turn)
        return _there(pose, twist.x * left + c * x - s * y, twist.y * left + s * x + c * y)


def _there(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """Transform from base_link at ``pose`` to the world."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return pose.x + c * x - s * y, pose.y + s * x + c * y


def _seen(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """Transform from the world to base_link at ``pose``."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    x, y = x - pose.x, y - pose.y
    return c * x + s * y, c * y - s * x
