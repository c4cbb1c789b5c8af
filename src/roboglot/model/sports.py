"""Counts an exercise's repetitions from skeletons in a picture, seen from the front or the side. Knows no camera."""

from __future__ import annotations

import math
from collections.abc import Callable

from roboglot.model.perception import JOINTS, SkeletonSeen, Sport
from roboglot.values import dataclass

GAP_MAX = 1.0  # s without a usable skeleton after which an unfinished repetition is discarded
_INDEX = {name: number for number, name in enumerate(JOINTS)}


class _Figure:
    """Heights of a skeleton's joints above its ankles or each other, in its own measure."""

    def __init__(self, skeleton: SkeletonSeen) -> None:
        self._joints, self._aspect = skeleton.joints, skeleton.aspect
        # The longer of torso and shoulders: one of them is foreshortened, whatever the person's orientation.
        torso = math.dist(self._at("shoulder"), self._at("hip"))
        shoulders = math.dist(self._one("left_shoulder"), self._one("right_shoulder"))
        self.measure = max(torso, 1.3 * shoulders, 1e-6)

    def above(self, upper: str, lower: str) -> float:
        """Return how much higher in the picture the one pair of joints lies than the other, in measures."""
        return (self._at(lower)[1] - self._at(upper)[1]) / self.measure

    def knees_apart(self) -> float:
        """Return how much higher one knee is than the other."""
        return abs(self._one("left_knee")[1] - self._one("right_knee")[1]) / self.measure

    def off_the_hands(self) -> float:
        """Shoulders above wrists while the body is stretched out flat; standing and bent knees do not count as low."""
        flat = self.above("shoulder", "hip") < 0.6 and self.above("knee", "hip") < 0.2
        return self.above("shoulder", "wrist") if flat else 1.0

    def _one(self, name: str) -> tuple[float, float]:
        joint = self._joints[_INDEX[name]]
        return joint.x * self._aspect, joint.y

    def _at(self, name: str) -> tuple[float, float]:
        left, right = self._one(f"left_{name}"), self._one(f"right_{name}")
        return (left[0] + right[0]) / 2, (left[1] + right[1]) / 2


@dataclass(frozen=True, slots=True)
class _Rule:
    """A repetition: ``feature`` goes to ``there`` and comes back to ``back``."""

    feature: Callable[[_Figure], float]
    there: float
    back: float


_RULES: dict[Sport, _Rule] = {
    Sport.SQUAT: _Rule(lambda figure: figure.above("hip", "ankle"), 1.05, 1.35),
    Sport.HIGH_KNEES: _Rule(lambda figure: figure.knees_apart(), 0.45, 0.2),
    Sport.SIT_UP: _Rule(lambda figure: figure.above("shoulder", "hip"), 0.6, 0.3),
    Sport.PUSH_UP: _Rule(lambda figure: figure.off_the_hands(), 0.55, 0.8),
    Sport.JUMPING_JACK: _Rule(lambda figure: figure.above("wrist", "shoulder"), 0.4, -0.4),
}


class SportCounter:
    """``count``: whole repetitions so far; ``duration``: seconds that a plank was held."""

    def __init__(self, sport: Sport) -> None:
        self.sport = sport
        self.count = 0
        self.duration = 0.0
        self._there = False
        self._last: float | None = None

    def see(self, skeleton: SkeletonSeen, stamp: float) -> None:
        """Look at one more picture of the same person; ``stamp`` in s."""
        if sum(joint.visible for joint in skeleton.joints) < len(JOINTS) // 2:
            return
        figure = _Figure(skeleton)
        gap = 0.0 if self._last is None else stamp - self._last
        self._last = stamp
        if self.sport is Sport.PLANK:
            if _planking(figure) and gap <= GAP_MAX:
                self.duration += gap
            return
        if gap > GAP_MAX:
            self._there = False
        self._count(_RULES[self.sport], figure)

    def _count(self, rule: _Rule, figure: _Figure) -> None:
        way = 1.0 if rule.there > rule.back else -1.0
        value = rule.feature(figure) * way
        if not self._there and value > rule.there * way:
            self._there = True
        elif self._there and value < rule.back * way:
            self._there = False
            self.count += 1


def _planking(figure: _Figure) -> bool:
    """Stretched out flat, held up by the arms."""
    return abs(figure.above("shoulder", "hip")) < 0.5 and figure.above("shoulder", "elbow") > 0.3
