"""Joints of a person who stands, walks, makes a gesture or does sport.

In the person's own frame: x ahead, y left, z up from the floor, m. A stick figure; knows no world and no camera.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from roboglot.model.perception import JOINTS, Gesture, Sport

Floats = NDArray[np.float64]
TALL, WIDE = 1.75, 0.22  # m: height and radius to which the places below refer
STRIDE, SWING = 0.72, 0.35  # m per step; m of an ankle's swing
PAD_LOW = np.array((0.10, 0.05, 0.08))  # m around the joints, below, behind and to the right
PAD_HIGH = np.array((0.10, 0.05, 0.10))
_INDEX = {name: number for number, name in enumerate(JOINTS)}
_Places = dict[str, tuple[float, float, float]]

_UPRIGHT: _Places = {
    "nose": (0.11, 0, 1.62), "eye": (0.09, 0.035, 1.65), "ear": (0.0, 0.08, 1.63), "shoulder": (0, 0.19, 1.43),
    "elbow": (-0.02, 0.25, 1.14), "wrist": (0.04, 0.26, 0.88), "hip": (0, 0.10, 0.92), "knee": (0.02, 0.10, 0.49),
    "ankle": (0, 0.10, 0.08),
}  # fmt: skip
_SQUATTING: _Places = {
    "nose": (0.21, 0, 1.15), "eye": (0.19, 0.035, 1.18), "ear": (0.10, 0.08, 1.16), "shoulder": (0.08, 0.19, 0.97),
    "elbow": (0.33, 0.20, 0.95), "wrist": (0.58, 0.20, 0.95), "hip": (-0.28, 0.10, 0.50), "knee": (0.12, 0.12, 0.48),
    "ankle": (0, 0.12, 0.08),
}  # fmt: skip
_JUMPED: _Places = {
    "shoulder": (0, 0.19, 1.45), "elbow": (0, 0.32, 1.66), "wrist": (0, 0.20, 1.90), "knee": (0.02, 0.26, 0.51),
    "ankle": (0, 0.42, 0.10),
}  # fmt: skip
_LYING: _Places = {  # on the back, feet first
    "nose": (-0.62, 0, 0.20), "eye": (-0.66, 0.035, 0.19), "ear": (-0.64, 0.08, 0.10), "shoulder": (-0.45, 0.19, 0.10),
    "elbow": (-0.50, 0.33, 0.14), "wrist": (-0.66, 0.14, 0.16), "hip": (0.05, 0.10, 0.10), "knee": (0.33, 0.10, 0.42),
    "ankle": (0.55, 0.10, 0.08),
}  # fmt: skip
_SITTING: _Places = {
    "nose": (0.28, 0, 0.79), "eye": (0.26, 0.035, 0.82), "ear": (0.18, 0.08, 0.80), "shoulder": (0.15, 0.19, 0.60),
    "elbow": (0.30, 0.30, 0.66), "wrist": (0.16, 0.14, 0.78), "hip": (0.05, 0.10, 0.10), "knee": (0.33, 0.10, 0.42),
    "ankle": (0.55, 0.10, 0.08),
}  # fmt: skip
_PRESSED_UP: _Places = {  # arms straight, head first
    "nose": (0.83, 0, 0.56), "eye": (0.84, 0.035, 0.60), "ear": (0.76, 0.08, 0.63), "shoulder": (0.55, 0.19, 0.55),
    "elbow": (0.56, 0.22, 0.29), "wrist": (0.57, 0.22, 0.03), "hip": (0.07, 0.10, 0.40), "knee": (-0.32, 0.10, 0.25),
    "ankle": (-0.72, 0.10, 0.10),
}  # fmt: skip
_PRESSED_DOWN: _Places = {
    "nose": (0.83, 0, 0.19), "eye": (0.84, 0.035, 0.22), "ear": (0.76, 0.08, 0.24), "shoulder": (0.57, 0.19, 0.18),
    "elbow": (0.42, 0.36, 0.22), "wrist": (0.57, 0.22, 0.03), "hip": (0.07, 0.10, 0.17), "knee": (-0.32, 0.10, 0.14),
    "ankle": (-0.72, 0.10, 0.10),
}  # fmt: skip
_PLANKING: _Places = {
    "nose": (0.83, 0, 0.32), "eye": (0.84, 0.035, 0.36), "ear": (0.76, 0.08, 0.39), "shoulder": (0.55, 0.19, 0.33),
    "elbow": (0.56, 0.20, 0.03), "wrist": (0.80, 0.12, 0.04), "hip": (0.07, 0.10, 0.27), "knee": (-0.32, 0.10, 0.19),
    "ankle": (-0.72, 0.10, 0.10),
}  # fmt: skip


def _arranged(places: _Places) -> Floats:
    """Return the joints (n, 3) in the order of JOINTS, right ones mirrored; missing ones as in an upright body."""
    whole = np.empty((len(JOINTS), 3))
    for name, row in _INDEX.items():
        side, _, part = name.rpartition("_")
        x, y, z = (_UPRIGHT | places)[part]
        whole[row] = x, -y if side == "right" else y, z
    return whole


UPRIGHT = _arranged({})
_ENDS: dict[Sport, tuple[Floats, Floats]] = {
    Sport.SQUAT: (UPRIGHT, _arranged(_SQUATTING)),
    Sport.JUMPING_JACK: (UPRIGHT, _arranged(_JUMPED)),
    Sport.SIT_UP: (_arranged(_LYING), _arranged(_SITTING)),
    Sport.PUSH_UP: (_arranged(_PRESSED_UP), _arranged(_PRESSED_DOWN)),
    Sport.PLANK: (_arranged(_PLANKING), _arranged(_PLANKING)),
}
# Places of the right elbow and wrist; for gestures that move, where the wrist goes within a second and back.
_ARMS: dict[Gesture, tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]] = {
    Gesture.PULL: ((0.20, -0.30, 1.15), (0.55, -0.22, 1.35), (0.25, -0.22, 1.35)),
    Gesture.PUSH: ((0.20, -0.30, 1.15), (0.25, -0.22, 1.35), (0.55, -0.22, 1.35)),
    Gesture.UP: ((0.15, -0.30, 1.15), (0.42, -0.28, 1.05), (0.42, -0.28, 1.60)),
    Gesture.DOWN: ((0.15, -0.30, 1.15), (0.42, -0.28, 1.60), (0.42, -0.28, 1.05)),
    Gesture.LEFT: ((0.18, -0.28, 1.15), (0.42, -0.45, 1.35), (0.42, 0.15, 1.35)),
    Gesture.RIGHT: ((0.18, -0.28, 1.15), (0.42, 0.15, 1.35), (0.42, -0.45, 1.35)),
    Gesture.STOP: ((0.15, -0.28, 1.15), (0.40, -0.24, 1.40), (0.40, -0.24, 1.40)),
    Gesture.THUMB_UP: ((0.10, -0.28, 1.12), (0.35, -0.22, 1.22), (0.35, -0.22, 1.22)),
    Gesture.THUMB_DOWN: ((0.10, -0.28, 1.12), (0.35, -0.22, 1.18), (0.35, -0.22, 1.18)),
    Gesture.OPEN: ((0.12, -0.28, 1.15), (0.38, -0.24, 1.36), (0.38, -0.24, 1.36)),
    Gesture.CLOSE: ((0.12, -0.28, 1.15), (0.38, -0.24, 1.36), (0.38, -0.24, 1.36)),
    Gesture.V: ((0.05, -0.34, 1.25), (0.10, -0.36, 1.62), (0.10, -0.36, 1.62)),
    Gesture.V_DOWN: ((0.05, -0.36, 1.30), (0.12, -0.34, 1.00), (0.12, -0.34, 1.00)),
    Gesture.PHOTO: ((0.10, -0.34, 1.36), (0.25, -0.14, 1.56), (0.25, -0.14, 1.56)),
}


def walking(way: float) -> Floats:
    """Return the joints (n, 3; m) of a walking person after ``way`` m."""
    joints = UPRIGHT.copy()
    swing = SWING * math.sin(math.pi * way / STRIDE)
    for side, ahead in (("left", swing), ("right", -swing)):
        joints[_INDEX[f"{side}_ankle"], 0] += ahead
        joints[_INDEX[f"{side}_knee"], 0] += ahead / 2
        joints[_INDEX[f"{side}_wrist"], 0] -= ahead / 2
    return joints


def gesturing(gesture: Gesture, elapsed: float) -> Floats:
    """Return the joints (n, 3; m) ``elapsed`` s into a gesture of the right hand; PHOTO takes both hands."""
    joints = UPRIGHT.copy()
    elbow, begin, end = (np.array(place) for place in _ARMS[gesture])
    wrist = begin + (end - begin) * _there_and_back(elapsed)
    joints[_INDEX["right_elbow"]], joints[_INDEX["right_wrist"]] = elbow, wrist
    if gesture is Gesture.PHOTO:
        joints[_INDEX["left_elbow"]], joints[_INDEX["left_wrist"]] = elbow * (1, -1, 1), wrist * (1, -1, 1)
    return joints


def exercising(sport: Sport, part: float) -> Floats:
    """Return the joints (n, 3; m) after ``part`` repetitions; 0.5: half of the first one."""
    if sport is not Sport.HIGH_KNEES:
        begin, end = _ENDS[sport]
        return begin + (end - begin) * _there_and_back(part)
    joints = UPRIGHT.copy()
    side = "left" if math.floor(part) % 2 == 0 else "right"  # alternating knees
    raised = _there_and_back(part)
    joints[_INDEX[f"{side}_knee"]] += np.array((0.40, 0, 0.45)) * raised
    joints[_INDEX[f"{side}_ankle"]] += np.array((0.32, 0, 0.45)) * raised
    return joints


def extent(joints: Floats) -> tuple[Floats, Floats]:
    """Return the lowest and highest corner of the block around the body, m."""
    low, high = joints.min(axis=0) - PAD_LOW, joints.max(axis=0) + PAD_HIGH
    low[2] = max(0.0, low[2])
    return low, high


@lru_cache(maxsize=64)
def size(height: float, radius: float) -> Floats:
    """Return the scale (x, y, z) from the places above to a person of this size (m)."""
    return np.array((radius / WIDE, radius / WIDE, height / TALL))


def _there_and_back(part: float) -> float:
    return 0.5 - 0.5 * math.cos(math.tau * part)
