"""Motions of legged robots besides walking: jumps, flips, gestures and dances, in one table.

A motion begins in a posture, takes its time and leaves the robot in a posture and, after jumps and steps, in another
place. Knows no vendor's numbers and no way in which a body does it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum

from roboglot.model.components.motion.feet import TROT, Foot, Footfall
from roboglot.model.components.motion.posture import Posture
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.values import dataclass


class Motion(StrEnum):
    """Motion, by name."""

    GET_UP_FAST = "get up fast"
    GET_UP = "get up"
    GET_UP_SLOW = "get up slowly"
    SOMERSAULT_STAND = "somersault stand"
    BACK_FLIP = "back flip"
    FRONT_FLIP = "front flip"
    BOW = "bow"
    ROLL_LEFT = "roll left"
    ROLL_RIGHT = "roll right"
    JUMP_STAIR = "jump up a stair"
    JUMP_DOWN_STAIR = "jump down a stair"
    JUMP_DOWN_PLATFORM = "jump down a platform"
    FLIP_RIGHT = "right side flip"
    FLIP_LEFT = "left side flip"
    RUN_FRONT_FLIP = "run and front flip"
    RUN_FLIP = "run and flip"
    JUMP_LEFT_TURN = "jump left turn"
    JUMP_RIGHT_TURN = "jump right turn"
    JUMP_FORWARD_60 = "jump forward 60 cm"
    JUMP_FORWARD_30 = "jump forward 30 cm"
    JUMP_LEFT_20 = "jump left 20 cm"
    JUMP_RIGHT_20 = "jump right 20 cm"
    JUMP_UP_30 = "jump up 30 cm"
    DANCE_COLLECTION = "dance collection"
    SHAKE_LEFT_HAND = "shake left hand"
    SHAKE_RIGHT_HAND = "shake right hand"
    SIT_DOWN = "sit down"
    HIP_CIRCLE = "circle with the hip"
    HEAD_CIRCLE = "circle with the head"
    STRETCH = "stretch"
    WAG_LEFT = "sway left sitting"
    WAG_RIGHT = "sway right sitting"
    WAG = "sway left and right sitting"
    BALLET = "ballet"
    MOONWALK = "moonwalk"
    JUMPING_JACK_FRONT = "front-leg jumping jack"
    JUMPING_JACK_REAR = "hind-leg jumping jack"
    LIFT_LEFT_AND_NOD = "lift left leg and nod"
    LIFT_RIGHT_AND_NOD = "lift right leg and nod"
    SPREAD_LEFT_FRONT = "spread left front and right rear leg"
    SPREAD_RIGHT_FRONT = "spread right front and left rear leg"
    WALK_AND_NOD = "walk and nod"
    WALK_SPREADING = "walk with legs spread by turns"
    STEP_AND_NOD = "step on the spot and nod"
    FRONT_LEGS_JUMP = "front legs jump back and forth"
    REAR_LEGS_JUMP = "hind legs jump back and forth"
    LIFT_FRONT_LEGS = "lift front legs by turns"
    LIFT_REAR_LEGS = "lift hind legs by turns"
    JUMP_COLLECTION = "jump collection"
    STEP_STRETCHING = "step stretching left and right"
    JUMP_SWINGING = "jump swinging legs"
    STEP_SWINGING = "step swinging legs"
    STEP_RIGHT_LEG = "step right leg back and forth"
    STEP_LEFT_LEG = "step left leg back and forth"
    BACK_FLIPS = "back flips in a row"
    SQUAT = "squat on all fours"
    PUSH_UP = "push-up"
    BOW_AND_HEART = "bow and heart"
    DANCE_1 = "dance 1"
    DANCE_2 = "dance 2"
    DANCE_3 = "dance 3"
    FRONT_FLIP_CLAP = "front flip with clap"
    JUMP_RAISE_HAND = "jump and raise hand"
    DANCE_4 = "dance 4"
    DANCE_5 = "dance 5"
    DANCE_6 = "dance 6"
    DANCE_7 = "dance 7"
    DANCE_8 = "dance 8"
    PLATFORM_BACK_FLIP = "platform back flip"
    PLATFORM_FRONT_FLIP = "platform front flip"
    SKATEBOARD_BACK_FLIP = "skateboard back flip"
    SKATEBOARD_FRONT_FLIP = "skateboard front flip"
    SKATEBOARD_BALANCE = "skateboard balance"
    SKATEBOARD_KICK = "skateboard kick"
    WALK_UPRIGHT = "walk upright"
    HANDSTAND_SPLIT = "handstand split"


@dataclass(frozen=True, slots=True)
class Sway:
    """Swing of the body about its rest pose during a motion: amplitudes in m and rad, ``beat`` in Hz.

    ``rest_*``: the rest pose itself (sitting is nose up, lying on a side is rolled).
    """

    beat: float = 0.5
    height: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    rest_height: float = 0.0  # below standing, m
    rest_roll: float = 0.0
    rest_pitch: float = 0.0


@dataclass(frozen=True, slots=True)
class MotionSpec:
    """One line of the table.

    ``duration`` (s) is the whole motion's; ``way`` the net change of base_link, in base_link at the start (m, rad; the
    yaw may be more than a turn in several jumps); ``peak`` how high the feet fly (m, 0: they stay on the floor), in
    ``jumps`` jumps; ``roll`` and ``pitch`` the body's turning in the air in each of them, rad; ``run_up`` what of the
    way is run first, m; ``footfalls`` who is in the air in the middle of a figure, again and again (none, or as
    it walks).
    """

    duration: float
    way: Pose = ORIGIN
    peak: float = 0.0
    jumps: int = 0
    roll: float = 0.0
    pitch: float = 0.0
    run_up: float = 0.0
    sway: Sway = Sway()
    footfalls: tuple[Footfall, ...] = ()
    before: frozenset[Posture] = frozenset({Posture.STANDING})
    after: Posture = Posture.STANDING


TURN, QUARTER = math.tau, math.pi / 2
FLIP_PEAK = 0.40  # m that feet fly in a flip
_DOWN: frozenset[Foot] = frozenset()
_LF, _RF = frozenset({Foot.LEFT_FRONT}), frozenset({Foot.RIGHT_FRONT})
_LR, _RR = frozenset({Foot.LEFT_REAR}), frozenset({Foot.RIGHT_REAR})
_ANY = frozenset({Posture.STANDING, Posture.SITTING, Posture.LYING, Posture.CHANGING})
_SITTING = frozenset({Posture.SITTING})
_SIT = Sway(rest_pitch=-0.6, rest_height=0.04)


def _jump(duration: float, peak: float, x: float = 0.0, y: float = 0.0, yaw: float = 0.0, jumps: int = 1) -> MotionSpec:
    return MotionSpec(duration, Pose(x, y, yaw), peak, jumps)


def _flip(
    duration: float,
    x: float = 0.0,
    y: float = 0.0,
    *,
    roll: float = 0.0,
    pitch: float = 0.0,
    jumps: int = 1,
    run_up: float = 0.0,
) -> MotionSpec:
    return MotionSpec(duration, Pose(x, y), FLIP_PEAK, jumps, roll, pitch, run_up)


def _figure(duration: float, x: float = 0.0, footfalls: tuple[Footfall, ...] = (), **sway: float) -> MotionSpec:
    return MotionSpec(duration, Pose(x), sway=Sway(**sway), footfalls=footfalls)


def _up(*turns: frozenset[Foot], seconds: float = 0.4) -> tuple[Footfall, ...]:
    """Return footfalls that lift these feet one after the other, for ``seconds`` each."""
    return tuple(Footfall(seconds, frozenset(Foot) - turn) for turn in turns)


def _get_up(duration: float) -> MotionSpec:
    return MotionSpec(duration, before=_ANY | {Posture.LIMP})


def _sitting(duration: float, **sway: float) -> MotionSpec:
    rested = Sway(rest_pitch=_SIT.rest_pitch, rest_height=_SIT.rest_height, **sway)
    return MotionSpec(duration, sway=rested, before=_SITTING, after=Posture.SITTING)


def _dance(duration: float = 120.0) -> MotionSpec:
    return _figure(duration, beat=0.8, height=0.03, roll=0.15, pitch=0.10, yaw=0.20)


# Durations are the CyberDog 2's: the sum of the steps where its motion list is published and short (sitting down,
# swaying, shaking hands, stretching, squats, push-ups), otherwise the time-out of its motion service.
# The distance and height of the flips are the simulation's assumptions where the name does not state them.
MOTIONS: Mapping[Motion, MotionSpec] = {
    Motion.GET_UP_FAST: _get_up(5.0),
    Motion.GET_UP: _get_up(5.0),
    Motion.GET_UP_SLOW: _get_up(5.0),
    Motion.SOMERSAULT_STAND: _flip(8.0, pitch=TURN, x=0.10),
    Motion.BACK_FLIP: _flip(8.0, pitch=-TURN, x=-0.30),
    Motion.FRONT_FLIP: _flip(8.0, pitch=TURN, x=0.40),
    Motion.BOW: _figure(10.0, rest_pitch=-0.4, beat=0.8, pitch=0.08),
    Motion.ROLL_LEFT: _figure(20.0, rest_roll=-1.2, rest_height=0.10),
    Motion.ROLL_RIGHT: _figure(20.0, rest_roll=1.2, rest_height=0.10),
    Motion.JUMP_STAIR: _jump(5.0, 0.25, x=0.55),
    Motion.JUMP_DOWN_STAIR: _jump(5.0, 0.10, x=0.45),
    Motion.JUMP_DOWN_PLATFORM: _jump(15.0, 0.12, x=0.55),
    Motion.FLIP_RIGHT: _flip(8.0, roll=TURN, y=-0.40),
    Motion.FLIP_LEFT: _flip(8.0, roll=-TURN, y=0.40),
    Motion.RUN_FRONT_FLIP: _flip(8.0, pitch=TURN, x=1.50, run_up=0.80),
    Motion.RUN_FLIP: _flip(30.0, pitch=TURN, x=2.00, run_up=1.20),
    Motion.JUMP_LEFT_TURN: _jump(1.5, 0.12, yaw=QUARTER),
    Motion.JUMP_RIGHT_TURN: _jump(1.5, 0.12, yaw=-QUARTER),
    Motion.JUMP_FORWARD_60: _jump(2.5, 0.15, x=0.60),
    Motion.JUMP_FORWARD_30: _jump(1.5, 0.12, x=0.30),
    Motion.JUMP_LEFT_20: _jump(1.5, 0.10, y=0.20),
    Motion.JUMP_RIGHT_20: _jump(1.5, 0.10, y=-0.20),
    Motion.JUMP_UP_30: _jump(1.5, 0.30),
    Motion.DANCE_COLLECTION: _dance(60.0),
    Motion.SHAKE_LEFT_HAND: _figure(7.5, rest_pitch=-0.3, rest_roll=0.08, beat=1.2, pitch=0.04, footfalls=_up(_LF)),
    Motion.SHAKE_RIGHT_HAND: _figure(7.5, rest_pitch=-0.3, rest_roll=-0.08, beat=1.2, pitch=0.04, footfalls=_up(_RF)),
    Motion.SIT_DOWN: MotionSpec(2.5, sway=_SIT, after=Posture.SITTING),
    Motion.HIP_CIRCLE: _figure(15.0, beat=0.5, roll=0.15, yaw=0.15),
    Motion.HEAD_CIRCLE: _figure(15.0, beat=0.5, pitch=0.18, yaw=0.18),
    Motion.STRETCH: _figure(3.5, rest_pitch=0.25, rest_height=0.05, beat=0.3, pitch=0.12),
    Motion.WAG_LEFT: _sitting(1.4, beat=0.5, roll=-0.12),
    Motion.WAG_RIGHT: _sitting(1.4, beat=0.5, roll=0.12),
    Motion.WAG: _sitting(2.0, beat=1.0, roll=0.12, yaw=0.10),
    Motion.BALLET: _figure(30.0, beat=0.6, height=0.03, roll=0.12, yaw=0.25),
    Motion.MOONWALK: _figure(15.0, x=-0.40, beat=1.0, pitch=0.06),
    Motion.JUMPING_JACK_FRONT: _figure(
        15.0, beat=1.5, height=0.02, pitch=0.10, footfalls=_up(_LF | _RF, _DOWN, seconds=0.2)
    ),
    Motion.JUMPING_JACK_REAR: _figure(
        15.0, beat=1.5, height=0.02, pitch=-0.10, footfalls=_up(_LR | _RR, _DOWN, seconds=0.2)
    ),
    Motion.LIFT_LEFT_AND_NOD: _figure(15.0, rest_roll=0.10, beat=0.8, pitch=0.12, footfalls=_up(_LF)),
    Motion.LIFT_RIGHT_AND_NOD: _figure(15.0, rest_roll=-0.10, beat=0.8, pitch=0.12, footfalls=_up(_RF)),
    Motion.SPREAD_LEFT_FRONT: _figure(
        15.0, rest_height=0.03, beat=0.6, roll=0.08, yaw=0.12, footfalls=_up(_LF | _RR, _DOWN)
    ),
    Motion.SPREAD_RIGHT_FRONT: _figure(
        15.0, rest_height=0.03, beat=0.6, roll=-0.08, yaw=-0.12, footfalls=_up(_RF | _LR, _DOWN)
    ),
    Motion.WALK_AND_NOD: _figure(15.0, x=0.60, beat=1.0, pitch=0.12),
    Motion.WALK_SPREADING: _figure(15.0, x=0.60, beat=1.0, height=0.02, roll=0.06),
    Motion.STEP_AND_NOD: _figure(15.0, beat=1.0, pitch=0.12, footfalls=TROT),
    Motion.FRONT_LEGS_JUMP: _figure(
        15.0, beat=1.5, height=0.01, pitch=0.12, footfalls=_up(_LF | _RF, _DOWN, seconds=0.2)
    ),
    Motion.REAR_LEGS_JUMP: _figure(
        15.0, beat=1.5, height=0.01, pitch=-0.12, footfalls=_up(_LR | _RR, _DOWN, seconds=0.2)
    ),
    Motion.LIFT_FRONT_LEGS: _figure(15.0, rest_pitch=-0.08, beat=0.8, roll=0.10, footfalls=_up(_LF, _RF)),
    Motion.LIFT_REAR_LEGS: _figure(15.0, rest_pitch=0.08, beat=0.8, roll=0.10, footfalls=_up(_LR, _RR)),
    Motion.JUMP_COLLECTION: _jump(15.0, 0.10, jumps=5),
    Motion.STEP_STRETCHING: _figure(15.0, beat=1.0, roll=0.12, footfalls=TROT),
    Motion.JUMP_SWINGING: _jump(15.0, 0.06, jumps=6),
    Motion.STEP_SWINGING: _figure(15.0, beat=1.0, roll=0.10, yaw=0.08, footfalls=TROT),
    Motion.STEP_RIGHT_LEG: _figure(15.0, beat=1.0, pitch=0.06, roll=-0.05, footfalls=_up(_RF, _DOWN)),
    Motion.STEP_LEFT_LEG: _figure(15.0, beat=1.0, pitch=0.06, roll=0.05, footfalls=_up(_LF, _DOWN)),
    Motion.BACK_FLIPS: _flip(15.0, pitch=-TURN, x=-0.90, jumps=3),
    Motion.SQUAT: _figure(7.0, rest_height=0.04, beat=0.5, height=0.04),
    Motion.PUSH_UP: _figure(7.0, rest_height=0.05, beat=0.5, height=0.05),
    Motion.BOW_AND_HEART: _figure(15.0, rest_pitch=-0.4, beat=0.8, pitch=0.08, yaw=0.08),
    Motion.DANCE_1: _dance(),
    Motion.DANCE_2: _dance(),
    Motion.DANCE_3: _dance(),
    Motion.FRONT_FLIP_CLAP: _flip(15.0, pitch=TURN, x=0.40),
    Motion.JUMP_RAISE_HAND: _jump(1.0, 0.08),
    Motion.DANCE_4: _dance(),
    Motion.DANCE_5: _dance(),
    Motion.DANCE_6: _dance(),
    Motion.DANCE_7: _dance(),
    Motion.DANCE_8: _dance(),
    Motion.PLATFORM_BACK_FLIP: _flip(1.9, pitch=-TURN, x=-0.45),
    Motion.PLATFORM_FRONT_FLIP: _flip(1.8, pitch=TURN, x=0.45),
    Motion.SKATEBOARD_BACK_FLIP: _flip(1.9, pitch=-TURN, x=-0.30),
    Motion.SKATEBOARD_FRONT_FLIP: _flip(1.8, pitch=TURN, x=0.30),
    Motion.SKATEBOARD_BALANCE: _figure(10.0, beat=0.7, roll=0.12),
    Motion.SKATEBOARD_KICK: _figure(10.0, x=0.80, beat=1.0, roll=0.08, pitch=0.05),
    Motion.WALK_UPRIGHT: _figure(
        10.0, x=0.40, rest_pitch=-1.2, beat=1.0, roll=0.06, footfalls=_up(_LF | _RF | _LR, _LF | _RF | _RR)
    ),
    Motion.HANDSTAND_SPLIT: _figure(10.0, rest_pitch=1.3, beat=0.5, yaw=0.10, footfalls=_up(_LR | _RR)),
}
