"""Limits of a legged body: possible poses, balance, and its walk on a leash. Pure geometry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

from roboglot.model.components.motion.feet import FOOTFALL_SECONDS_MIN, FOOTFALLS_MAX, Foot, Footfall, Foothold
from roboglot.model.components.motion.gaits import FOOT_LIFT_MAX
from roboglot.model.components.motion.legs import STEPS_MAX, BodyPose, LegLimits, Step, check_lift, check_pose
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import STILL, Orientation, Point, Twist, bounded
from roboglot.simulation.bodies.performing import Body

STEP_SECONDS_MAX = 60.0
ON_TWO_FEET_MAX, ON_FEWER_MAX = 0.6, 0.3  # s for which a robot keeps its balance; on three feet, forever
TAUT, GIVING = 3.0, 0.05  # N of a pull that it notices, and m/s by which it yields per further N


def added(now: Body, by: BodyPose, limits: LegLimits) -> BodyPose:
    """Return the sum of the current pose and ``by``, within the limits."""
    a, b = now.attitude, by.attitude
    return BodyPose(
        None if by.height is None else max(limits.lowest, min(limits.highest, now.height + by.height)),
        Orientation(*(bounded(x + y, limits.angle) for x, y in ((a.roll, b.roll), (a.pitch, b.pitch), (a.yaw, b.yaw)))),
        Point(bounded(now.shift.x + by.shift.x, limits.shift), bounded(now.shift.y + by.shift.y, limits.shift)),
    )


def check_steps(steps: Sequence[Step], footfalls: Sequence[Footfall], limits: LegLimits, fastest: Twist) -> None:
    """Raise InvalidGoal for a choreography that the body cannot follow, by its steps or its balance."""
    if len(steps) > STEPS_MAX:
        raise InvalidGoal(f"a choreography has at most {STEPS_MAX} steps")
    for step in steps:
        check_pose(step.body, limits)
        check_lift(step.lift)
        if not 0.0 <= step.seconds <= STEP_SECONDS_MAX or step.twist.clamped(fastest) != step.twist:
            raise InvalidGoal("a step is too long or too fast")
        if not 0.0 < step.friction < math.inf or not 0.0 <= step.landing < math.inf:
            raise InvalidGoal("a step's friction or landing is out of range")
        if step.footholds:
            _check_footholds(step.footholds, limits)
    if footfalls:
        _check_balance(footfalls)


def _check_footholds(footholds: Sequence[Foothold], limits: LegLimits) -> None:
    if len(footholds) != len(Foot):
        raise InvalidGoal(f"a step has {len(Foot)} footholds or none")
    for hold in footholds:
        if not math.hypot(hold.x, hold.y) <= limits.reach or not abs(hold.z) <= limits.reach:
            raise InvalidGoal(f"a foot comes down at most {limits.reach} m beside its place")
        if not 0.0 <= hold.lift <= FOOT_LIFT_MAX:
            raise InvalidGoal(f"feet are lifted by at most {FOOT_LIFT_MAX} m")


def _check_balance(footfalls: Sequence[Footfall]) -> None:
    if len(footfalls) > FOOTFALLS_MAX:
        raise InvalidGoal(f"there are at most {FOOTFALLS_MAX} footfalls")
    if not all(FOOTFALL_SECONDS_MIN <= footfall.seconds <= STEP_SECONDS_MAX for footfall in footfalls):
        raise InvalidGoal(f"a footfall takes {FOOTFALL_SECONDS_MIN} to {STEP_SECONDS_MAX:g} s")
    runs = [(down, sum(each.seconds for each in same)) for down, same in groupby(footfalls, lambda each: each.down)]
    if runs[0][0] == runs[-1][0]:  # the run continues at the beginning
        endless = len(runs) == 1
        runs[0] = (runs[0][0], math.inf if endless else runs[0][1] + runs[-1][1])
    for down, seconds in runs:
        if len(down) < 3 and seconds > (ON_TWO_FEET_MAX if len(down) == 2 else ON_FEWER_MAX) + 1e-9:
            raise InvalidGoal(f"the robot would fall with {len(down)} feet down for {seconds:g} s")


def led(pull: tuple[float, float], turned: float) -> Twist:
    """Return the velocity of a robot at yaw ``turned`` (rad) under a pull (N, world); it grows with the pull.

    The robot turns towards the pull; a slack leash leaves it standing.
    """
    strength = math.hypot(*pull)
    if strength <= TAUT:
        return STILL
    bearing = math.remainder(math.atan2(pull[1], pull[0]) - turned, math.tau)
    speed = GIVING * (strength - TAUT)
    return Twist(speed * math.cos(bearing), speed * math.sin(bearing), bearing)
