"""Frames of motions and choreographies of a body on legs, tick by tick. Pure time and geometry.

Knows no physics: the player of the frames detects obstacles.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from roboglot.model.components.motion.feet import Footfall
from roboglot.model.components.motion.legs import CENTRED, FootLift, Step
from roboglot.model.components.motion.motions import MotionSpec, Sway
from roboglot.model.components.motion.posture import Posture
from roboglot.model.geometry import LEVEL, STILL, Orientation, Point, Pose, Twist
from roboglot.simulation.bodies.footfalls import FootfallCycle, Swings, lifted
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.values import dataclass

CROUCH, PUSH, RECOVER = 0.20, 0.08, 0.25  # s: to bend before a jump, to stretch, to straighten after it
DIP = 0.08  # m by which it bends
RAMP = 1.5  # s at most to enter and leave a figure
OFF_MAX, OFF_ANGLE_MAX = 0.08, 0.15  # m and rad from the expected end within which a motion counts as completed
PAWS = lifted(FootLift(0.06, 0.06))  # m by which paws are lifted in figures
RUN_SPEED = 0.8  # m/s, mean of a run-up
STRAIGHTEN = 0.6  # s to straighten up again


@dataclass(frozen=True, slots=True)
class Body:
    """Pose of the torso: belly height above base_link (m), attitude and shift against it."""

    height: float
    attitude: Orientation = LEVEL
    shift: Point = CENTRED

    def towards(self, other: Body, part: float) -> Body:
        """Return the body between this one (``part`` 0) and the other (1)."""
        a, b = self.attitude, other.attitude
        return Body(
            _mix(self.height, other.height, part),
            Orientation(_mix(a.roll, b.roll, part), _mix(a.pitch, b.pitch, part), _mix(a.yaw, b.yaw, part)),
            Point(_mix(self.shift.x, other.shift.x, part), _mix(self.shift.y, other.shift.y, part)),
        )

    def turn_to(self, other: Body) -> float:
        """Return the largest difference in roll, pitch or yaw, rad."""
        a, b = self.attitude, other.attitude
        return max(abs(a.roll - b.roll), abs(a.pitch - b.pitch), abs(a.yaw - b.yaw))


@dataclass(frozen=True, slots=True)
class MotionTick:
    """One tick: the body, and base_link's motion. ``leap``: take off now, for this time (s). ``landed``: stop now."""

    body: Body
    twist: Twist = STILL
    leap: float = 0.0
    airborne: bool = False
    landed: bool = False
    lift: float | None = None  # m by which every foot is lifted at least while stepping; None: the gait's
    feet: Swings | None = None  # feet in the air; None: the gait's


@dataclass(frozen=True, slots=True)
class Stance:
    """Dimensions of the body: its straight stand, the lowest and highest belly, the tick in s."""

    straight: Body
    lowest: float
    highest: float
    tick: float

    def at(self, height: float, attitude: Orientation = LEVEL, shift: Point = CENTRED) -> Body:
        """Return a body at ``height`` within the legs' range."""
        return Body(max(self.lowest, min(self.highest, height)), attitude, shift)


class Track:
    """Motion of a body from ``start`` to ``goal`` in ``seconds``."""

    def __init__(self, start: Body, goal: Body, seconds: float) -> None:
        self._start, self._goal, self._seconds = start, goal, max(seconds, 1e-9)
        self._gone = 0.0
        self.halted = False

    @property
    def over(self) -> bool:
        """True if the goal is reached."""
        return self._gone >= self._seconds

    def advance(self, seconds: float) -> Body:
        """Return the body after further ``seconds``."""
        self._gone = min(self._seconds, self._gone + (0.0 if self.halted else seconds))
        return self._start.towards(self._goal, self._gone / self._seconds)


class Performance:
    """A motion under way: its frames, whether it is ``held``, whether an obstacle was ``hit``, the last ``lift``."""

    def __init__(self, frames: Iterator[MotionTick]) -> None:
        self.frames = frames
        self.frame: MotionTick | None = None
        self.lift: float | None = None
        self.over = False
        self.held = False
        self.hit = False

    @property
    def in_the_air(self) -> bool:
        """True if the feet have left the ground, so that nothing can hold the motion."""
        return self.frame is not None and self.frame.airborne

    def hold(self) -> None:
        """Hold the present frame, or the one after landing."""
        self.held = True


def motion_frames(spec: MotionSpec, begin: Body, stance: Stance) -> Iterator[MotionTick]:
    """Return all ticks of a motion."""
    if spec.jumps:
        return _jumps(spec, begin, stance)
    return _figure(spec, begin, stance)


def dance_frames(
    steps: Sequence[Step], begin: Body, stance: Stance, footfalls: Sequence[Footfall] = ()
) -> Iterator[MotionTick]:
    """Yield all ticks of a choreography, and of straightening at its end."""
    body, twist, ticks, end = begin, STILL, 0, 0.0
    order = FootfallCycle(footfalls) if footfalls else None
    for step in steps:
        height = body.height if step.body.height is None else step.body.height
        goal = stance.at(height, step.body.attitude, step.body.shift)
        holds = step.footholds or lifted(step.lift)
        lift = min(hold.lift for hold in holds)
        end += step.seconds
        count = round(end / stance.tick) - ticks  # rounded values do not add up
        for index in range(count):
            twist = _gripping(twist, step.twist, step.friction * GRAVITY * stance.tick)
            feet = order.swings(ticks * stance.tick, holds, step.landing) if order else None
            ticks += 1
            yield MotionTick(body.towards(goal, ease((index + 1) / count)), twist, lift=lift, feet=feet)
        body = goal
    yield from straighten(body, stance)


def _gripping(now: Twist, wanted: Twist, most: float) -> Twist:
    """Return the velocity ``now`` moved to ``wanted`` by at most ``most`` m/s."""
    change = math.hypot(wanted.x - now.x, wanted.y - now.y)
    if change <= most:
        return wanted
    return Twist(_mix(now.x, wanted.x, most / change), _mix(now.y, wanted.y, most / change), wanted.yaw)


def straighten(begin: Body, stance: Stance) -> Iterator[MotionTick]:
    """Yield the ticks from any body to a straight stand."""
    for part in _parts(STRAIGHTEN, stance):
        yield MotionTick(begin.towards(stance.straight, ease(part)))


def fall(begin: Body, stance: Stance, seconds: float) -> Iterator[MotionTick]:
    """Yield the ticks of a fall in place, after a leap was stopped in the air."""
    for part in _parts(seconds, stance):
        yield MotionTick(begin.towards(stance.straight, part), airborne=True)
    yield MotionTick(stance.straight, landed=True)


def strayed(there: Pose, wanted: Pose) -> bool:
    """True if the end of a motion is too far from the ``wanted`` one."""
    return there.distance_to(wanted) > OFF_MAX or abs(there.relative_to(wanted).yaw) > OFF_ANGLE_MAX


def ease(part: float) -> float:
    """Return a smooth step from 0 to 1."""
    part = max(0.0, min(1.0, part))
    return part * part * (3.0 - 2.0 * part)


def _figure(spec: MotionSpec, begin: Body, stance: Stance) -> Iterator[MotionTick]:
    """Yield a motion with feet on the floor: to the rest pose, swinging about it, to the end pose, while walking."""
    sway, duration = spec.sway, spec.duration
    rest = stance.at(stance.straight.height - sway.rest_height, Orientation(roll=sway.rest_roll, pitch=sway.rest_pitch))
    end = rest if spec.after is Posture.SITTING else stance.straight
    ramp = min(RAMP, 0.2 * duration)
    order = FootfallCycle(spec.footfalls) if spec.footfalls else None
    for part in _parts(duration, stance):
        t = part * duration
        into, out = ease(t / ramp), ease((duration - t) / ramp)
        body = begin.towards(rest, into) if t < duration - ramp else end.towards(rest, out)
        # Whole periods, so that the mean speed is distance / duration.
        wave = (1.0 - math.cos(math.tau * part)) / duration
        twist = Twist(spec.way.x * wave, spec.way.y * wave, spec.way.yaw * wave) if spec.way != Pose() else STILL
        feet = order.swings(t - ramp, PAWS, 1.0) if order and ramp <= t <= duration - ramp else None
        yield MotionTick(_swung(body, sway, t, into * out, stance), twist, feet=feet)


def _swung(body: Body, sway: Sway, t: float, share: float, stance: Stance) -> Body:
    """Return the swinging body at ``t`` s; yaw is a quarter beat ahead, so that roll or pitch with yaw make circles."""
    sine, cosine = share * math.sin(math.tau * sway.beat * t), share * math.cos(math.tau * sway.beat * t)
    a = body.attitude
    attitude = Orientation(a.roll + sway.roll * sine, a.pitch + sway.pitch * sine, a.yaw + sway.yaw * cosine)
    return stance.at(body.height + sway.height * sine, attitude, body.shift)


def _jumps(spec: MotionSpec, begin: Body, stance: Stance) -> Iterator[MotionTick]:
    """Yield a run-up, if any, then the jumps, spread evenly over the duration."""
    run = spec.run_up / RUN_SPEED
    for part in _parts(run, stance) if run else ():
        speed = spec.run_up / run * (1.0 - math.cos(math.tau * part))
        yield MotionTick(begin.towards(stance.straight, part), Twist(speed))
    air = max(1, round(math.sqrt(8.0 * spec.peak / GRAVITY) / stance.tick)) * stance.tick
    idle = max(0.0, (spec.duration - run) / spec.jumps - (CROUCH + PUSH + air + RECOVER))
    velocity = Twist(
        (spec.way.x - spec.run_up) / spec.jumps / air, spec.way.y / spec.jumps / air, spec.way.yaw / spec.jumps / air
    )
    bent = stance.at(stance.straight.height - DIP)
    for number in range(spec.jumps):
        body = begin if number == 0 and not run else stance.straight
        yield from (MotionTick(body.towards(bent, 0.0)) for _ in _parts(0.6 * idle, stance))
        yield from (MotionTick(body.towards(bent, ease(part))) for part in _parts(CROUCH, stance))
        yield from (MotionTick(bent.towards(stance.straight, part)) for part in _parts(PUSH, stance))
        yield from _flight(spec, velocity, air, stance)
        for part in _parts(RECOVER, stance):
            yield MotionTick(stance.straight.towards(bent, math.sin(math.pi * part) * 0.6))
        yield from (MotionTick(stance.straight) for _ in _parts(0.4 * idle, stance))


def _flight(spec: MotionSpec, velocity: Twist, air: float, stance: Stance) -> Iterator[MotionTick]:
    """Yield a flight, turning about the body's own axes, and the landing."""
    for index, part in enumerate(_parts(air, stance)):
        turned = Orientation(math.remainder(spec.roll * part, math.tau), math.remainder(spec.pitch * part, math.tau))
        body = Body(stance.straight.height, turned)
        yield MotionTick(body, velocity, leap=0.0 if index else air, airborne=True)
    yield MotionTick(stance.straight, landed=True)


def _parts(seconds: float, stance: Stance) -> Iterator[float]:
    """Return the share of ``seconds`` that has passed, at the end of each tick."""
    ticks = round(seconds / stance.tick)
    return ((index + 1) / ticks for index in range(ticks))


def _mix(a: float, b: float, part: float) -> float:
    return a + (b - a) * part
