"""Four feet that step: planted ones stay where they are in the world, the others swing to their next foothold.

Kinematic: base_link is moved by others; this says where the feet are meanwhile, and whether they let it go on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from roboglot.model.components.feet import Foot, FootState
from roboglot.model.geometry import STILL, Point, Pose, Twist, Vector3
from roboglot.simulation.footfalls import DOWN, Swing, Swings

HOME = 0.01  # m beside its place at which a foot is at home


class Feet:
    """Where the feet of one body are, in the world's frame."""

    def __init__(self, homes: Sequence[Point], reach: float, pose: Pose) -> None:
        self._homes, self._reach, self._below_hips = homes, reach, homes
        self._hanging = False
        self._places = [pose.compose(Pose(home.x, home.y)) for home in homes]
        self._heights = [0.0] * len(homes)
        self._starts: list[tuple[Pose, float] | None] = [None] * len(homes)  # where a swing began, and how high
        self._last: list[Swing | None] = [None] * len(homes)
        self.restless = False  # whether one is not at home, or in the air

    def states(self, pose: Pose) -> Mapping[Foot, FootState]:
        """Where they are, seen from base_link at ``pose``."""
        states = {}
        for index, foot in enumerate(Foot):
            place = self._places[index].relative_to(pose)
            grounded = not self._hanging and self._starts[index] is None and self._heights[index] <= 0.0
            states[foot] = FootState(Vector3(place.x, place.y, self._heights[index]), grounded)
        return states

    def narrow(self, inward: float) -> None:
        """Come down so much (m) nearer to the body's middle from now on than below the hips."""
        self._homes = [Point(hip.x, hip.y - math.copysign(inward, hip.y)) for hip in self._below_hips]

    def hang(self, pose: Pose) -> None:
        """They touch nothing: the robot flies, is held up or lies on its side."""
        self._hanging = self.restless = True
        self._places = [pose.compose(Pose(home.x, home.y)) for home in self._homes]
        self._heights = [0.0] * len(self._homes)
        self._starts = [None] * len(self._homes)

    def holds_back(self, pose: Pose, twist: Twist, swings: Swings) -> bool:
        """Whether a leg that stands is stretched to its end and ``twist`` (base_link) would stretch it further."""
        if twist == STILL:
            return False
        for index, home in enumerate(self._homes):
            if swings[index] is None and self._starts[index] is None:
                place = self._places[index].relative_to(pose)
                x, y = place.x - home.x, place.y - home.y
                away = x * (twist.x - twist.yaw * place.y) + y * (twist.y + twist.yaw * place.x)
                if away < 0.0 and math.hypot(x, y) >= self._reach:
                    return True
        return False

    def step(self, pose: Pose, twist: Twist, swings: Swings = DOWN) -> None:
        """One tick: base_link is at ``pose`` and moves at ``twist``; None of ``swings`` stands."""
        self._hanging = False
        if swings is DOWN and not self.restless and twist == STILL and self._near(pose):
            return
        self.restless = False
        for index, swing in enumerate(swings):
            if swing is None:
                self._stand(index, pose, twist)
            else:
                self._swing(index, swing, pose, twist)
            self.restless |= self._starts[index] is not None or self._off(index, pose) > HOME

    def _near(self, pose: Pose) -> bool:
        return self._off(0, pose) <= HOME and self._off(3, pose) <= HOME

    def _off(self, index: int, pose: Pose) -> float:
        place, home = self._places[index].relative_to(pose), self._homes[index]
        return math.hypot(place.x - home.x, place.y - home.y)

    def _stand(self, index: int, pose: Pose, twist: Twist) -> None:
        """It lands, if it was in the air; a body that is pushed too far drags it along."""
        last = self._last[index]
        if self._starts[index] is not None and last is not None:
            self._places[index] = self._foothold(index, last, 0.0, pose, twist)
            self._heights[index] = max(0.0, last.to.z)
        self._starts[index] = self._last[index] = None
        off = self._off(index, pose)
        if off > self._reach:
            home, place = self._homes[index], self._places[index].relative_to(pose)
            share = self._reach / off
            self._places[index] = pose.compose(
                Pose(home.x + (place.x - home.x) * share, home.y + (place.y - home.y) * share)
            )

    def _swing(self, index: int, swing: Swing, pose: Pose, twist: Twist) -> None:
        start = self._starts[index]
        if start is None:
            start = self._starts[index] = (self._places[index], self._heights[index])
        self._last[index] = swing
        (place, height), share = start, swing.share
        goal = self._foothold(index, swing, 0.0 if swing.left == math.inf else swing.left, pose, twist)
        self._places[index] = Pose(place.x + (goal.x - place.x) * share, place.y + (goal.y - place.y) * share)
        end = max(0.0, swing.to.z)
        self._heights[index] = height + (end - height) * share + swing.to.lift * swing.rise

    def _foothold(self, index: int, swing: Swing, left: float, pose: Pose, twist: Twist) -> Pose:
        """Where it will come down: half of the way of its stand ahead of its place, as the body will be by then."""
        home, half = self._homes[index], swing.stand / 2
        there = pose.compose(Pose(twist.x * left, twist.y * left, twist.yaw * left)) if left else pose
        x = home.x + swing.to.x + (twist.x - twist.yaw * home.y) * half
        y = home.y + swing.to.y + (twist.y + twist.yaw * home.x) * half
        return there.compose(Pose(x, y))
