"""Every motion of the table, tick by tick, without physics: how long, how far, how it begins and ends."""

import itertools
import math

import pytest

from roboglot.model.components.motion.legs import BodyPose, Step
from roboglot.model.components.motion.motions import MOTIONS, Motion, MotionSpec
from roboglot.model.components.motion.posture import Posture
from roboglot.model.geometry import LEVEL, Orientation, Twist
from roboglot.simulation.bodies.performing import (
    Body,
    Stance,
    dance_frames,
    motion_frames,
)

TICK = 0.02
STANCE = Stance(Body(0.22), lowest=0.05, highest=0.30, tick=TICK)


def frames_of(motion: Motion):
    return list(motion_frames(MOTIONS[motion], STANCE.straight, STANCE))


def test_every_motion_has_a_line():
    assert set(MOTIONS) == set(Motion)
    assert all(isinstance(spec, MotionSpec) for spec in MOTIONS.values())


@pytest.mark.parametrize("motion", Motion)
def test_takes_its_time_and_goes_its_way(motion):
    spec, frames = MOTIONS[motion], frames_of(motion)
    assert len(frames) * TICK == pytest.approx(spec.duration, rel=0.02, abs=0.08)
    way = [sum(getattr(frame.twist, axis) for frame in frames) * TICK for axis in ("x", "y", "yaw")]
    assert way == pytest.approx([spec.way.x, spec.way.y, spec.way.yaw], abs=1e-6)
    assert sum(frame.leap > 0.0 for frame in frames) == spec.jumps == sum(frame.landed for frame in frames)


@pytest.mark.parametrize("motion", Motion)
def test_ends_as_the_table_says_and_never_jerks(motion):
    spec, frames = MOTIONS[motion], frames_of(motion)
    end = frames[-1].body
    if spec.after is Posture.SITTING:
        assert end.attitude.pitch == pytest.approx(-0.6)
    else:
        assert end.height == pytest.approx(STANCE.straight.height)
        assert max(map(abs, (end.attitude.roll, end.attitude.pitch, end.attitude.yaw))) < 1e-9
    for before, after in itertools.pairwise(frames):
        assert abs(after.body.height - before.body.height) < 0.04
        turned = math.remainder(after.body.attitude.pitch - before.body.attitude.pitch, math.tau)
        rolled = math.remainder(after.body.attitude.roll - before.body.attitude.roll, math.tau)
        assert max(abs(turned), abs(rolled)) < 0.5
    assert all(STANCE.lowest <= frame.body.height <= STANCE.highest for frame in frames)


def test_a_flip_turns_once_in_the_air():
    flying = [frame for frame in frames_of(Motion.BACK_FLIP) if frame.airborne]
    turned = [frame.body.attitude.pitch for frame in flying]
    steps = [math.remainder(b - a, math.tau) for a, b in zip([0.0, *turned], turned, strict=False)]
    assert sum(steps) == pytest.approx(-math.tau)
    assert len(flying) * TICK == pytest.approx(math.sqrt(8 * 0.4 / 9.81), abs=0.02)


def test_a_dance_comes_to_each_pose_and_back():
    steps = [
        Step(0.5, body=BodyPose(height=0.15)),
        Step(1.0, Twist(0.1, 0.0, 0.2), BodyPose(attitude=Orientation(roll=0.2))),
    ]
    frames = list(dance_frames(steps, STANCE.straight, STANCE))
    assert frames[24].body.height == pytest.approx(0.15)
    assert frames[74].body == Body(0.15, Orientation(roll=0.2))
    assert frames[74].twist == Twist(0.1, 0.0, 0.2)
    assert frames[-1].body == Body(0.22, LEVEL)
