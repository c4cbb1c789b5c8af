"""The steps of a body on legs: gait, lift of the feet, and the feet's places."""

from __future__ import annotations

from roboglot.model.components.motion.gaits import GAITS, Gait
from roboglot.model.components.motion.legs import FootLift
from roboglot.model.geometry import STILL, Point, Twist
from roboglot.simulation.bodies.body import LegsSection
from roboglot.simulation.bodies.feet import Feet
from roboglot.simulation.bodies.footfalls import DOWN, walking
from roboglot.simulation.bodies.hull import Hull, wheel_places
from roboglot.simulation.bodies.performing import MotionTick
from roboglot.simulation.bodies.walking_body import no_floor_under


class Steps:
    """Steps; ``count``: number of steps so far, with fractions; ``feet``: None for a body on wheels."""

    def __init__(self, section: LegsSection, hull: Hull) -> None:
        assert hull.legs is not None, "legs belong to a body that has them"
        self._hull, self._legs = hull, hull.legs
        self.gait: Gait | None = section.gait
        self.lift, self.count = FootLift(), 0.0
        places = [wheel_places(hull.body)[index] for index in (1, 0, 3, 2)]  # in the order of Foot
        self.feet = Feet([Point(x, y) for x, y in places], section.reach, hull.pose) if section.gait else None

    def walk(self, gait: Gait | None, lift: FootLift) -> None:
        """Set gait and lift from now on."""
        self.gait, self.lift = gait, lift
        if self.feet:
            self.feet.narrow(lift.inward)
        self.step_over(None)

    def step_over(self, lowest: float | None) -> None:
        """Set the height (m) of obstacles that pass under the body; None: the gait's. Wheels keep their clearance."""
        walking = min(self.lift.front, self.lift.rear) if self.gait else self._hull.body.hull.clearance
        self._hull.clearance = self._legs.step_over(walking if lowest is None or not self.gait else lowest)

    def step(self, velocity: Twist, seconds: float, frame: MotionTick | None = None, *, standing: bool = False) -> None:
        """Move the feet with the body: at ``velocity``, ``standing``, or by a ``frame`` of a motion."""
        if self.feet is None or self.gait is None:
            return
        if no_floor_under(self._hull, frame):
            self.feet.hang(self._hull.pose)
            return
        swings = DOWN
        if frame and frame.feet:
            swings = frame.feet
        elif velocity != STILL or (self.feet.restless and standing):
            if frame or velocity == STILL:  # otherwise the body would sway with the steps and count them
                self.count += GAITS[self.gait].steps * seconds
            swings = walking(self.gait, self.count, self.lift)
        self.feet.step(self._hull.pose, velocity, swings, seconds)

    def hold_back(self, frame: MotionTick) -> bool:
        """True if feet on the ground hold the body back from the motion of ``frame``."""
        if not frame.feet or self.feet is None:
            return False
        return self.feet.holds_back(self._hull.pose, frame.twist, frame.feet)
