"""Four mecanum wheels: kinematics both ways, limited accelerations, grip. Knows no obstacles; the physics does."""

from __future__ import annotations

import math

from roboglot.model.components.base import Base, BaseLimits, WheelSpeeds
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import STILL, Twist
from roboglot.simulation.body import Base as BaseSection
from roboglot.simulation.hull import Hull

NO_WHEELS = WheelSpeeds()


class SimulatedBase(Base):
    """The wheels turn as told; whether the body follows is between them, the floor and what stands in the way."""

    def __init__(self, section: BaseSection, hull: Hull) -> None:
        self.limits = BaseLimits(
            twist=Twist(section.speed, section.speed, section.yaw_speed),
            linear_acceleration=section.acceleration,
            angular_acceleration=section.yaw_acceleration,
        )
        self._hull = hull
        self._radius = section.wheel_radius
        self._lever = (section.wheel_base + section.track) / 2
        self._target: Twist | WheelSpeeds = STILL
        self._twist = STILL
        self._wheels = NO_WHEELS
        self._locks: dict[str, str] = {}

    def set_velocity(self, twist: Twist) -> None:
        if not all(map(math.isfinite, (twist.x, twist.y, twist.yaw))):
            raise InvalidGoal("a velocity is finite")
        self._refuse_if_locked(twist != STILL)
        self._target = twist.clamped(self.limits.twist)

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        if not all(map(math.isfinite, _four(speeds))):
            raise InvalidGoal("a wheel's speed is finite")
        self._refuse_if_locked(speeds != NO_WHEELS)
        body, limit = self._body_of(speeds), self.limits.twist
        fastest = max(map(abs, _four(speeds))) * self._radius
        top = limit.x + self._lever * limit.yaw
        over = max(1.0, body.speed / limit.x, abs(body.yaw) / limit.yaw, fastest / top)
        self._target = WheelSpeeds(*(wheel / over for wheel in _four(speeds)))

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        return self._wheels

    @property
    def velocity(self) -> Twist:
        return self._twist

    def lock(self, who: str, reason: str) -> None:
        """Brake, and refuse to drive until ``who`` unlocks it again."""
        self._locks[who] = reason
        self._target = STILL

    def unlock(self, who: str) -> None:
        """``who`` has no objection any more; does nothing if it had none."""
        self._locks.pop(who, None)

    def cut(self) -> None:
        """Block the wheels at once, without the gentle ramp."""
        self._target = self._twist = STILL
        self._wheels = NO_WHEELS

    def control(self, seconds: float) -> None:
        """Come nearer to the target as fast as the accelerations allow."""
        if self._target is not self._twist:
            match self._target:
                case Twist() as target:
                    self._twist = self._nearer(target, seconds)
                    self._wheels = self._wheels_of(self._twist)
                case WheelSpeeds() as target:
                    self._wheels = self._nearer_wheels(target, seconds)
                    self._twist = self._body_of(self._wheels)
        self._hull.drive(self._twist, seconds)

    def _refuse_if_locked(self, moving: bool) -> None:
        if moving and self._locks:
            raise Refused(next(iter(self._locks.values())))

    def _nearer(self, target: Twist, seconds: float) -> Twist:
        now, linear = self._twist, self.limits.linear_acceleration * seconds
        angular = self.limits.angular_acceleration * seconds
        dx, dy, dyaw = target.x - now.x, target.y - now.y, target.yaw - now.yaw
        way = math.hypot(dx, dy)
        if way <= linear and abs(dyaw) <= angular:
            return target
        part = min(1.0, linear / way) if way else 1.0
        return Twist(now.x + dx * part, now.y + dy * part, now.yaw + max(-angular, min(angular, dyaw)))

    def _nearer_wheels(self, target: WheelSpeeds, seconds: float) -> WheelSpeeds:
        step = self.limits.linear_acceleration * seconds / self._radius
        pairs = zip(_four(self._wheels), _four(target), strict=True)
        return WheelSpeeds(*(now + max(-step, min(step, goal - now)) for now, goal in pairs))

    def _wheels_of(self, twist: Twist) -> WheelSpeeds:
        turn = self._lever * twist.yaw
        return WheelSpeeds(
            front_left=(twist.x - twist.y - turn) / self._radius,
            front_right=(twist.x + twist.y + turn) / self._radius,
            rear_left=(twist.x + twist.y - turn) / self._radius,
            rear_right=(twist.x - twist.y + turn) / self._radius,
        )

    def _body_of(self, wheels: WheelSpeeds) -> Twist:
        """What four wheels that disagree do to the body: the mean; the rest is slip."""
        fl, fr, rl, rr = _four(wheels)
        quarter = self._radius / 4
        return Twist(
            (fl + fr + rl + rr) * quarter, (-fl + fr + rl - rr) * quarter, (-fl + fr - rl + rr) * quarter / self._lever
        )


def _four(wheels: WheelSpeeds) -> tuple[float, float, float, float]:
    return wheels.front_left, wheels.front_right, wheels.rear_left, wheels.rear_right
