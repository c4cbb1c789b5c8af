"""Mecanum or differential drive: kinematics both ways, limited accelerations, brakes. Knows no obstacles; the physics
does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from roboglot.model.components.motion.base import Base, BaseLimits, WheelSpeeds
from roboglot.model.components.motion.legs import LEGS
from roboglot.model.errors import Blocked, Collided, InvalidGoal, Refused
from roboglot.model.geometry import STILL, Twist
from roboglot.simulation.bodies.body import BaseSection
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part

NO_WHEELS = WheelSpeeds()
STANDS = 0.01  # m/s; slower is standing
GLANCING = 0.1  # cosine between the way of the hull and what it touches up to which it passes along


class SimulatedBase(Base):
    """The wheels turn as commanded; whether the body follows is between them, the floor and what stands in the way.

    A differential drive has its wheels at the left and at the right: those in front and behind turn alike.
    """

    def __init__(self, section: BaseSection, hull: Hull) -> None:
        self._mecanum = section.drive == "mecanum"
        self.limits = BaseLimits(
            twist=Twist(section.speed, section.speed if self._mecanum else 0.0, section.yaw_speed),
            holonomic=self._mecanum,
            linear_acceleration=section.acceleration,
            angular_acceleration=section.yaw_acceleration,
        )
        self._hull = hull
        self._radius = section.wheel_radius
        self._lever = (section.wheel_base + section.track) / 2 if self._mecanum else section.track / 2
        self._target: Twist | WheelSpeeds = STILL
        self._twist = STILL
        self._wheels = NO_WHEELS
        self._locks: dict[str, Refused] = {}
        self._bars: dict[str, tuple[bool, bool, str]] = {}
        self._touching: tuple[tuple[float, float], ...] = ()
        self.pace = math.inf  # m/s that what stands ahead allows
        self._carried = False
        self._dead: frozenset[str] = frozenset()
        self._free = False
        self._hardest = max(1.0, (section.braking or 0.0) / section.acceleration)  # of the accelerations, in a pinch
        self._haste = 1.0  # of the accelerations that it takes now
        self._walkable: Callable[[Twist], Twist] = _any
        self.steer: float | None = None  # rad/s; a turn rate that takes the place of the commanded one

    def set_velocity(self, twist: Twist) -> None:
        if not all(map(math.isfinite, (twist.x, twist.y, twist.yaw))):
            raise InvalidGoal("a velocity is finite")
        self._refuse_if_locked(twist != STILL)
        if not self._mecanum:
            twist = Twist(twist.x, 0.0, twist.yaw)
        self.check_free(twist)
        self._target, self._carried = self._walkable(twist.clamped(self.limits.twist)), False
        self._take_time()

    def brake_hard(self) -> None:
        self.set_velocity(STILL)
        self._haste = self._hardest

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        if not all(map(math.isfinite, _four(speeds))):
            raise InvalidGoal("a wheel's speed is finite")
        self._refuse_if_locked(speeds != NO_WHEELS)
        body, limit = self._body_of(speeds), self.limits.twist
        self.check_free(body)
        fastest = max(map(abs, _four(speeds))) * self._radius
        top = limit.x + self._lever * limit.yaw
        over = max(1.0, body.speed / limit.x, abs(body.yaw) / limit.yaw, fastest / top)
        self._target, self._carried = WheelSpeeds(*(wheel / over for wheel in _four(speeds))), False
        self._take_time()

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        return self._turning_wheels(self._wheels) if self._dead else self._wheels

    @property
    def velocity(self) -> Twist:
        if self._free:
            return self._rolled()
        return self._body_of(self._turning_wheels(self._wheels)) if self._dead else self._twist

    def walk(self, walkable: Callable[[Twist], Twist] | None) -> None:
        """Cut velocities by ``walkable`` from now on: the gait's limits; None: the base's own are enough."""
        self._walkable = walkable or _any

    def lock(self, who: str, reason: str | Refused) -> None:
        """Brake, and refuse to drive until ``who`` unlocks it again; ``reason`` is why, or the error to refuse with."""
        self._locks[who] = reason if isinstance(reason, Refused) else Refused(reason)
        self._target = STILL

    def locked_by(self, who: str) -> bool:
        """True if ``who`` objects to driving."""
        return who in self._locks

    @property
    def refusal(self) -> Refused | None:
        """The first lock but the legs': who starts to drive makes them stand up."""
        return next((reason for who, reason in self._locks.items() if who != LEGS), None)

    @property
    def locked(self) -> bool:
        """True if a lock has it brake."""
        return bool(self._locks)

    def unlock(self, who: str) -> None:
        """``who`` has no objection any more; does nothing if it had none."""
        self._locks.pop(who, None)

    def bar(self, who: str, *, ahead: bool = False, behind: bool = False, reason: str = "") -> None:
        """Do not drive forwards or backwards, whatever is asked, until ``who`` bars it no more."""
        if ahead or behind:
            self._bars[who] = ahead, behind, reason
        else:
            self._bars.pop(who, None)

    def touch(self, bearings: tuple[tuple[float, float], ...]) -> None:
        """The hull touches something in these directions (unit vectors, base_link): it does not drive there."""
        self._touching = bearings

    @property
    def collides(self) -> bool:
        """True if the wheels, or what was asked of them, press the hull on what it touches; legs that leap aside."""
        if not self._touching or self._carried:
            return False
        return self._presses(self.wanted)

    @property
    def wanted(self) -> Twist:
        """The velocity that it is to have, or while it is to stand the one that it still has."""
        target = self._target if isinstance(self._target, Twist) else self._body_of(self._target)
        return target if target.speed > STANDS else self._twist

    def _presses(self, twist: Twist) -> bool:
        """True if this motion leads into what the hull touches; turning on the spot and passing along do not."""
        limit = max(STANDS, GLANCING * twist.speed)
        return any(twist.x * x + twist.y * y > limit for x, y in self._touching)

    def check_free(self, command: Twist | WheelSpeeds) -> None:
        if self._touching and self._presses(command if isinstance(command, Twist) else self._body_of(command)):
            raise Collided("the bumper is pressed: the robot moves only away from what it touches")

    def hindrance(self, command: Twist | WheelSpeeds) -> Blocked | None:
        if not self._bars:
            return None
        way = (command if isinstance(command, Twist) else self._body_of(command)).x
        for who, (ahead, behind, reason) in self._bars.items():
            if (ahead and way > 0.0) or (behind and way < 0.0):
                return Blocked(f"{who} stopped the robot: {reason}")
        return None

    @property
    def dead_wheels(self) -> frozenset[str]:
        """Wheels (field names of WheelSpeeds) whose motors give nothing."""
        return self._dead

    def kill_wheels(self, wheels: frozenset[str]) -> None:
        """These motors give nothing from now on: their wheels drag."""
        if wheels - set(WheelSpeeds.__slots__):
            raise ValueError(f"a wheel is one of {', '.join(WheelSpeeds.__slots__)}")
        if not self._mecanum:  # one motor a side
            sides = {wheel.split("_")[1] for wheel in wheels}
            wheels = frozenset(wheel for wheel in WheelSpeeds.__slots__ if wheel.split("_")[1] in sides)
        self._dead = wheels

    def roll_freely(self, free: bool) -> None:
        """Let the wheels run without brake and motor, or hold them again."""
        self._free = free
        self.cut()
        self._hull.roll_freely(free)

    def cut(self) -> None:
        """Block the wheels at once, without the gentle ramp."""
        self._target = self._twist = STILL
        self._wheels = NO_WHEELS

    def carry(self, twist: Twist) -> None:
        """The legs move base_link at ``twist`` at once, whatever locks the base for others."""
        self._target = self._twist = twist
        self._wheels, self._carried = self._wheels_of(twist), twist != STILL

    def control(self, seconds: float) -> None:
        """Come nearer to the target as fast as the accelerations allow."""
        if self._bars:
            self._respect_bars()
        wanted = self._target
        if self.steer is not None and isinstance(wanted, Twist):
            wanted = Twist(wanted.x, wanted.y, self.steer)
        if wanted is not self._twist:
            match wanted:
                case Twist() as target:
                    self._twist = self._nearer(target, seconds)
                    self._wheels = self._wheels_of(self._twist)
                case WheelSpeeds() as target:
                    self._wheels = self._nearer_wheels(target, seconds)
                    self._twist = self._body_of(self._wheels)
        if self.pace < math.inf and self._twist.speed > self.pace and not self._carried:
            share = self.pace / self._twist.speed
            self._twist = Twist(self._twist.x * share, self._twist.y * share, self._twist.yaw)
            self._wheels = self._wheels_of(self._twist)
        self._hull.drive(self.velocity if self._dead else self._twist, seconds)

    def _take_time(self) -> None:
        """Brake hard no more, unless it is to stand still."""
        if self._target not in (STILL, NO_WHEELS):
            self._haste = 1.0

    def _refuse_if_locked(self, moving: bool) -> None:
        if moving and self._locks:
            raise next(iter(self._locks.values()))

    def _respect_bars(self) -> None:
        """Block at once what is barred; a turn on the spot stays possible."""
        target = self._target if isinstance(self._target, Twist) else self._body_of(self._target)
        for ahead, behind, _ in self._bars.values():
            if (ahead and target.x > 0.0) or (behind and target.x < 0.0):
                self._target = target = Twist(0.0, 0.0, target.yaw)
            if (ahead and self._twist.x > 0.0) or (behind and self._twist.x < 0.0):
                self._twist = Twist(0.0, 0.0, self._twist.yaw)
                self._wheels = self._wheels_of(self._twist)

    def _turning_wheels(self, wheels: WheelSpeeds) -> WheelSpeeds:
        """Those that have a motor."""
        return replace(wheels, **dict.fromkeys(self._dead, 0.0))

    def _rolled(self) -> Twist:
        """Return an external push as the wheels feel it."""
        (vx, vy, _, turn), yaw = self._hull.motion, self._hull.turned
        c, s = math.cos(yaw), math.sin(yaw)
        return Twist(c * vx + s * vy, (c * vy - s * vx) if self._mecanum else 0.0, turn)

    def _nearer(self, target: Twist, seconds: float) -> Twist:
        now, linear = self._twist, self._haste * self.limits.linear_acceleration * seconds
        angular = self._haste * self.limits.angular_acceleration * seconds
        dx, dy, dyaw = target.x - now.x, target.y - now.y, target.yaw - now.yaw
        way = math.hypot(dx, dy)
        if way <= linear and abs(dyaw) <= angular:
            return target
        part = min(1.0, linear / way) if way else 1.0
        return Twist(now.x + dx * part, now.y + dy * part, now.yaw + max(-angular, min(angular, dyaw)))

    def _nearer_wheels(self, target: WheelSpeeds, seconds: float) -> WheelSpeeds:
        step = self._haste * self.limits.linear_acceleration * seconds / self._radius
        pairs = zip(_four(self._wheels), _four(target), strict=True)
        return WheelSpeeds(*(now + max(-step, min(step, goal - now)) for now, goal in pairs))

    def _wheels_of(self, twist: Twist) -> WheelSpeeds:
        turn = self._lever * twist.yaw
        if not self._mecanum:
            left, right = (twist.x - turn) / self._radius, (twist.x + turn) / self._radius
            return WheelSpeeds(left, right, left, right)
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
        if not self._mecanum:
            return Twist((fl + fr + rl + rr) * quarter, 0.0, (-fl + fr - rl + rr) * quarter / self._lever)
        return Twist(
            (fl + fr + rl + rr) * quarter, (-fl + fr + rl - rr) * quarter, (-fl + fr - rl + rr) * quarter / self._lever
        )


def _any(twist: Twist) -> Twist:
    return twist


def _four(wheels: WheelSpeeds) -> tuple[float, float, float, float]:
    return wheels.front_left, wheels.front_right, wheels.rear_left, wheels.rear_right


def _fit(fit: Fitting) -> SimulatedBase:
    return SimulatedBase(fit.body.base, fit.hull)


PART = Part(
    name="base",
    interface=Base,
    section=BaseSection,
    fit=_fit,
    control=SimulatedBase.control,
    control_after=("legs", "gimbal"),  # which say what it is to pass on
)
