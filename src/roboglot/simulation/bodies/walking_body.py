"""Movement of a walking or jumping body: sway with the steps, and landing after a jump. Starts no action."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

from roboglot.model.actions import Action
from roboglot.model.clock import Clock
from roboglot.model.components.motion.gaits import GaitSpec
from roboglot.model.components.motion.legs import FootLift, Posture
from roboglot.model.errors import Refused
from roboglot.model.geometry import Orientation, Twist
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.performing import Body, MotionTick, Performance, Stance, Track, fall, straighten
from roboglot.simulation.bodies.support import GRAVITY


def swayed(body: Body, spec: GaitSpec, strides: float, velocity: Twist, stance: Stance) -> Body:
    """Return ``body`` with sway and bounce after ``strides`` steps at ``velocity`` (m/s, rad/s)."""
    share = min(1.0, (velocity.speed + 0.2 * abs(velocity.yaw)) / 0.1)
    swing, a = share * math.sin(math.tau * strides), body.attitude
    turned = Orientation(a.roll, a.pitch + spec.rock * swing, a.yaw)
    return stance.at(body.height + spec.bounce * swing, turned, body.shift)


def landing(hull: Hull, body: Body, stance: Stance) -> Iterator[MotionTick]:
    """Return the frames of a fall of ``hull`` from its height in the air."""
    up = max(0.0, hull.motion[2])
    drop = max(0.0, hull.rise) + up**2 / (2 * GRAVITY)
    return fall(body, stance, math.sqrt(2 * drop / GRAVITY) + up / GRAVITY)


def held_body(hull: Hull) -> Body:
    """Return the body's present pose; set a body that lies on its side back onto its feet."""
    if not hull.overturned:
        return Body(hull.belly, hull.attitude, hull.shift)
    held = Body(hull.belly, Orientation(roll=hull.tilt[0]), hull.shift)
    hull.overturn(0.0)
    return held


async def followed(track: Track, action: Action, clock: Clock, period: float) -> None:
    """Wait until ``track`` is over, looking every ``period`` s; it halts while ``action`` is paused."""

    def halt() -> None:
        track.halted = True

    while not track.over:
        await clock.sleep(period)
        await action.hold(halt)
        track.halted = False


def walking_effort(hull: Hull, spec: GaitSpec, lift: FootLift) -> float:
    """Return the power for steps of this height, W."""
    return hull.body.hull.mass * GRAVITY * ((lift.front + lift.rear) / 2) * spec.steps


def no_floor_under(hull: Hull, frame: MotionTick | None) -> bool:
    """Return whether the feet hang: the body is held, lies on its back or is in the air."""
    return hull.hand is not None or hull.overturned or bool(frame and frame.airborne)


def check_posture(posture: Posture, before: frozenset[Posture], off: str) -> None:
    """Raise Refused unless the motors have power (``off`` is empty) and ``posture`` is in ``before``."""
    if posture not in before:
        raise Refused(f"the robot is {posture}; this begins {' or '.join(sorted(before))}")
    if off:
        raise Refused(off)


def given_up(performance: Performance, hull: Hull, body: Body, straight: Body, stance: Stance) -> Iterator[MotionTick]:
    """Return the frames after a performance was given up: land if in the air, then straighten."""
    if performance.frame and performance.frame.airborne:
        hull.stop()
        return chain(landing(hull, body, stance), straighten(straight, stance))
    return straighten(body, stance)
