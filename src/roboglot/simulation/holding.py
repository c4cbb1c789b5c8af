"""What a body on legs can be asked to hold: poses within its limits; where it walks on a leash. Pure geometry."""

from __future__ import annotations

import math

from roboglot.model.components.gaits import FOOT_LIFT_MAX, FOOT_LIFT_MIN
from roboglot.model.components.legs import BodyPose, FootLift, LegLimits
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import STILL, Orientation, Point, Twist
from roboglot.simulation.performing import Body

TAUT, GIVING = 3.0, 0.05  # N of a pull that it feels, and m/s that it gives way for every N more


def added(now: Body, by: BodyPose, limits: LegLimits) -> BodyPose:
    """What is held now and ``by`` on top, cut to the limits."""

    def cut(value: float, most: float) -> float:
        return max(-most, min(most, value))

    a, b = now.attitude, by.attitude
    return BodyPose(
        None if by.height is None else max(limits.lowest, min(limits.highest, now.height + by.height)),
        Orientation(*(cut(x + y, limits.angle) for x, y in ((a.roll, b.roll), (a.pitch, b.pitch), (a.yaw, b.yaw)))),
        Point(cut(now.shift.x + by.shift.x, limits.shift), cut(now.shift.y + by.shift.y, limits.shift)),
    )


def check_pose(body: BodyPose, limits: LegLimits) -> None:
    """Raises InvalidGoal for a pose that the legs cannot hold."""
    a = body.attitude
    numbers = (a.roll, a.pitch, a.yaw, body.shift.x, body.shift.y, body.height or 0.0)
    if not all(map(math.isfinite, numbers)):
        raise InvalidGoal("a body pose is finite")
    if body.height is not None and not limits.lowest <= body.height <= limits.highest:
        raise InvalidGoal(f"the belly is held {limits.lowest} to {limits.highest} m above the floor")
    if max(abs(a.roll), abs(a.pitch), abs(a.yaw)) > limits.angle:
        raise InvalidGoal(f"the body turns by at most {limits.angle} rad")
    if max(abs(body.shift.x), abs(body.shift.y)) > limits.shift:
        raise InvalidGoal(f"the body shifts by at most {limits.shift} m")


def check_lift(lift: FootLift) -> None:
    """Raises InvalidGoal for feet that are lifted too little or too far."""
    if not all(FOOT_LIFT_MIN <= height <= FOOT_LIFT_MAX for height in (lift.front, lift.rear)):
        raise InvalidGoal(f"feet are lifted by {FOOT_LIFT_MIN} to {FOOT_LIFT_MAX} m")


def led(pull: tuple[float, float], turned: float) -> Twist:
    """Where a robot that faces ``turned`` (rad) walks that is pulled so (N, both in the world): the harder, the faster.

    It turns to whoever pulls; a leash that hangs leaves it standing.
    """
    strength = math.hypot(*pull)
    if strength <= TAUT:
        return STILL
    bearing = math.remainder(math.atan2(pull[1], pull[0]) - turned, math.tau)
    speed = GIVING * (strength - TAUT)
    return Twist(speed * math.cos(bearing), speed * math.sin(bearing), bearing)
