"""Mecanum or differential drive: forward and inverse kinematics, limited accelerations, brakes.
Obstacles are the physics'.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from roboglot.model.components.motion.base import Base, BaseLimits, WheelSpeeds
from roboglot.model.components.motion.legs import LEGS
from roboglot.model.errors import Blocked, Collided, InvalidGoal, Refused
from roboglot.model.geometry import STILL, Twist
from roboglot.simulation.bodies.body import BaseSection
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.bodies.wheels import Wheels, four
from roboglot.simulation.components.motion.drive_locks import DriveLocks
from roboglot.simulation.components.motion.hindrances import STANDS, Hindrances
from roboglot.simulation.components.motion.ramp import Ramp

NO_WHEELS = WheelSpeeds()
SLOW = 0.3  # m/s: up to here nothing watches how fast it is


class SimulatedBase(Base):
    """Base whose wheels turn as commanded; whether the body follows depends on floor and obstacles.

    On a differential drive, front and rear wheels of a side turn alike.
    """

    def __init__(self, section: BaseSection, hull: Hull) -> None:
        self.duty = Duty()  # while the speed is not the commanded one
        self.when_driven: list[Callable[[], None]] = []  # called when the wheels' speed changes
        self.when_fast: list[Duty] = []  # start when it moves faster than SLOW, or is to
        self.wheels = wheels = Wheels(section, self._rewired)
        self.built = self.limits = BaseLimits(
            twist=Twist(section.speed, section.speed if wheels.mecanum else 0.0, section.yaw_speed),
            holonomic=wheels.mecanum,
            linear_acceleration=section.acceleration,
            angular_acceleration=section.yaw_acceleration,
        )
        self._hull = hull
        self._target: Twist | WheelSpeeds = STILL
        self._ramp = Ramp(hull)
        self._speeds: WheelSpeeds | None = None  # None: those of the velocity
        self.locks, self.hindrances = DriveLocks(self._stop), Hindrances(self.duty)
        self._carried = False
        self._free = False
        self._hardest = max(1.0, (section.braking or 0.0) / section.acceleration)  # factor in an emergency
        self._haste = 1.0  # the factor in use
        self._walkable: Callable[[Twist], Twist] = _any
        self._steered: float | None = None  # rad/s
        self._seconds = 0.0  # length of a tick, once one has passed

    def set_velocity(self, twist: Twist) -> None:
        if not all(map(math.isfinite, (twist.x, twist.y, twist.yaw))):
            raise InvalidGoal("a velocity must be finite")
        if twist != STILL:
            self.locks.check()
        if not self.wheels.mecanum:
            twist = Twist(twist.x, 0.0, twist.yaw)
        self.check_free(twist)
        wanted = self._walkable(twist.clamped(self.limits.twist))
        if self._ramp.now is self._target and wanted == self._target and not self._carried:
            self._haste = self._haste if wanted == STILL else 1.0
            return  # it moves so: drivers repeat a command at every tick
        self._target, self._carried = wanted, False
        self._take_time()

    def brake_hard(self) -> None:
        self.set_velocity(STILL)
        self._haste = self._hardest
        self.duty.begin()

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        if not all(map(math.isfinite, four(speeds))):
            raise InvalidGoal("a wheel's speed must be finite")
        if speeds != NO_WHEELS:
            self.locks.check()
        body, limit = self.wheels.twist_of(speeds), self.limits.twist
        self.check_free(body)
        fastest = max(map(abs, four(speeds))) * self.wheels.radius
        top = limit.x + self.wheels.lever * limit.yaw
        over = max(1.0, body.speed / limit.x, abs(body.yaw) / limit.yaw, fastest / top)
        self._target, self._carried = WheelSpeeds(*(wheel / over for wheel in four(speeds))), False
        self._take_time()

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        speeds = self._speeds or self.wheels.speeds_of(self._ramp.now)
        return self.wheels.driven(speeds) if self.wheels.dead else speeds

    @property
    def velocity(self) -> Twist:
        if self._free:
            return _rolled(self._hull, mecanum=self.wheels.mecanum)
        return self.wheels.twist_of(self.wheel_speeds) if self.wheels.dead else self._ramp.now

    def walk(self, walkable: Callable[[Twist], Twist] | None) -> None:
        """Limit velocities by ``walkable``, a gait's limits, from now on; None: by the base's own only."""
        self._walkable = walkable or _any

    @property
    def refusal(self) -> Refused | None:
        """Error of the first lock; not of the legs' lock, as they stand up when a drive starts."""
        return self.locks.first(but=LEGS)

    @property
    def collides(self) -> bool:
        """True if the velocity, commanded or present, presses the hull on an obstacle; never while legs carry it."""
        if not self.hindrances.touching or self._carried:
            return False
        return self.hindrances.presses(self.wanted)

    @property
    def wanted(self) -> Twist:
        """Commanded velocity; the present one if the command is to stand."""
        target = self.wheels.motion_of(self._target)
        return target if target.speed > STANDS else self._ramp.now

    def check_free(self, command: Twist | WheelSpeeds) -> None:
        if self.hindrances.touching and self.hindrances.presses(self.wheels.motion_of(command)):
            raise Collided("the bumper is pressed: the robot moves only away from what it touches")

    def hindrance(self, command: Twist | WheelSpeeds) -> Blocked | None:
        return self.hindrances.blocks(self.wheels.motion_of(command).x)

    def steer(self, rate: float | None) -> None:
        """Turn at ``rate`` (rad/s) instead of the commanded rate from now on; None: as commanded."""
        self._steered = rate
        self.duty.begin()

    def roll_freely(self, free: bool) -> None:
        """Let the wheels roll without brake and motor, or hold them again."""
        self._free = free
        self.cut()
        self._hull.roll_freely(free)

    def cut(self) -> None:
        """Block the wheels at once, without a ramp."""
        self._hull.robot_rows.tables.before_change()
        self._target, self._speeds = STILL, None
        self._turn_wheels(STILL)

    def carry(self, twist: Twist) -> None:
        """Move base_link at ``twist`` by the legs, at once and in spite of locks."""
        self._target = twist
        self._speeds, self._carried = None, twist != STILL
        self._note_pace()
        self._turn_wheels(twist)

    def control(self, seconds: float) -> None:
        """Approach the target velocity within the acceleration limits."""
        if self.hindrances.bars:
            self._respect_bars()
        wanted, now = self._target, self._ramp.now
        if self._steered is not None and isinstance(wanted, Twist):
            wanted = Twist(wanted.x, wanted.y, self._steered)
        self._seconds = seconds
        if self._goes_on():
            self.duty.end()
            return
        linear, angular = _steps(self.limits, self._haste * seconds)
        if wanted is not now:
            match wanted:
                case Twist() as target:
                    now, self._speeds = _nearer(now, target, linear, angular), None
                case WheelSpeeds() as target:
                    speeds = self._speeds or self.wheels.speeds_of(now)
                    self._speeds = _nearer_wheels(speeds, target, linear / self.wheels.radius)
                    now = self.wheels.twist_of(self._speeds)
        pace = self.hindrances.pace
        if pace < math.inf and now.speed > pace and not self._carried:
            share = pace / now.speed
            now, self._speeds = Twist(now.x * share, now.y * share, now.yaw), None
        self._turn_wheels(now)
        if now is self._target:
            self.duty.end()

    def _goes_on(self) -> bool:
        """Leave it to the kernel to approach the target if nothing else changes the speed."""
        target, watched = self._target, self.hindrances.bars or self.when_driven or self.wheels.dead
        if watched or self._steered is not None or not isinstance(target, Twist):
            return False
        if max(target.speed, self._ramp.now.speed) > self.hindrances.pace:
            return False
        if not self._ramp.go_on(target, *_steps(self.limits, self._haste * self._seconds)):
            return False
        self._speeds = None
        return True

    def _turn_wheels(self, twist: Twist) -> None:
        """Command the hull's wheels, some of which may be dead."""
        self._ramp.set(twist)
        for notice in self.when_driven:
            notice()
        self._hull.drive(self.velocity if self.wheels.dead else twist)
        self._hull.note_wheels(twist, slack=self._free or bool(self.wheels.dead))

    def _rewired(self) -> None:
        """Note that wheels died or live again."""
        self._hull.note_wheels(self._ramp.now, slack=self._free or bool(self.wheels.dead))
        self.duty.begin()

    def _take_time(self) -> None:
        """Begin to follow a command; end hard braking, unless it is to stand."""
        self._hull.robot_rows.tables.before_change()
        self._note_pace()
        if self._target not in (STILL, NO_WHEELS):
            self._haste = 1.0
        if self.duty.on or not self._seconds or not self._goes_on():
            self.duty.begin()

    def _note_pace(self) -> None:
        """Start what watches a base that moves faster than SLOW, or will."""
        for duty in self.when_fast:
            if not duty.on and max(self.wheels.motion_of(self._target).speed, self._ramp.now.speed) > SLOW:
                duty.begin()

    def _respect_bars(self) -> None:
        """Stop at once in a barred direction; a turn on the spot stays possible."""
        target = self.wheels.motion_of(self._target)
        if self.hindrances.blocks(target.x):
            self._target = Twist(0.0, 0.0, target.yaw)
            self._note_pace()
        if self.hindrances.blocks(self._ramp.now.x):
            self._ramp.set(Twist(0.0, 0.0, self._ramp.now.yaw))
            self._speeds = None

    def _stop(self) -> None:
        """Brake at the next opportunity."""
        self._target = STILL
        self.duty.begin()
        self._note_pace()


def _steps(limits: BaseLimits, seconds: float) -> tuple[float, float]:
    """Return the largest changes of velocity in ``seconds``, m/s and rad/s."""
    return limits.linear_acceleration * seconds, limits.angular_acceleration * seconds


def _rolled(hull: Hull, *, mecanum: bool) -> Twist:
    """Return the hull's velocity in base_link, as freely rolling wheels measure it."""
    (vx, vy, _, turn), yaw = hull.motion, hull.turned
    c, s = math.cos(yaw), math.sin(yaw)
    return Twist(c * vx + s * vy, (c * vy - s * vx) if mecanum else 0.0, turn)


def _nearer(now: Twist, target: Twist, linear: float, angular: float) -> Twist:
    """Return the velocity next to ``now`` on the way to ``target``, by steps of at most ``linear`` and ``angular``."""
    dx, dy, dyaw = target.x - now.x, target.y - now.y, target.yaw - now.yaw
    way = math.sqrt(dx * dx + dy * dy)  # as the kernel
    if way <= linear and abs(dyaw) <= angular:
        return target
    part = min(1.0, linear / way) if way else 1.0
    return Twist(now.x + dx * part, now.y + dy * part, now.yaw + max(-angular, min(angular, dyaw)))


def _nearer_wheels(speeds: WheelSpeeds, target: WheelSpeeds, step: float) -> WheelSpeeds:
    """Return the same for the speeds of wheels (rad/s)."""
    pairs = zip(four(speeds), four(target), strict=True)
    return WheelSpeeds(*(now + max(-step, min(step, goal - now)) for now, goal in pairs))


def _any(twist: Twist) -> Twist:
    return twist


def _fit(fit: Fitting) -> SimulatedBase:
    return SimulatedBase(fit.body.base, fit.hull)


PART = Part(
    name="base",
    interface=Base,
    section=BaseSection,
    fit=_fit,
    control=SimulatedBase.control,
    duty=lambda base: base.duty,
    control_after=("legs", "gimbal"),  # their commands go through the base
)
