"""Correction of a pose by seen landmarks, each with a step of an extended Kalman filter. Knows no robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.belief import SURE
from roboglot.model.geometry import Point, Pose, wrap_angle

NOISE = 0.04  # m: standard deviation of a strip's sighting relative to its landmark
GATE = 5.0  # standard deviations within which a strip matches a landmark: scan matching overrates its certainty
GATE_MAX = 1.0  # m, however uncertain the pose is

Floats = NDArray[np.float64]


def pose_fixed(pose: Pose, covariance: Floats, seen: Sequence[Point], known: Sequence[Point]) -> tuple[Pose, Floats]:
    """Return pose and covariance (x, y, yaw; map), corrected by strips ``seen`` (base_link) at ``known`` ones (map).

    A strip that matches no landmark or several is ignored.
    """
    for strip in seen:
        pose, covariance = _step(pose, covariance, strip, known)
    return pose, covariance


def _step(pose: Pose, covariance: Floats, strip: Point, known: Sequence[Point]) -> tuple[Pose, Floats]:
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    turned = (c * strip.x - s * strip.y, s * strip.x + c * strip.y)
    slope = np.array([[1.0, 0.0, -turned[1]], [0.0, 1.0, turned[0]]])
    spread = slope @ covariance @ slope.T + np.eye(2) * NOISE**2
    certain = np.linalg.inv(spread)
    near = []
    for landmark in known:
        off = np.array([landmark.x - pose.x - turned[0], landmark.y - pose.y - turned[1]])
        if math.hypot(*off) < GATE_MAX and float(off @ certain @ off) < GATE**2:
            near.append(off)
    if len(near) != 1:
        return pose, covariance
    gain = covariance @ slope.T @ certain
    dx, dy, turn = (gain @ near[0]).tolist()
    narrowed = (np.eye(3) - gain @ slope) @ covariance
    narrowed = (narrowed + narrowed.T) / 2.0
    np.fill_diagonal(narrowed, np.maximum(np.diag(narrowed), SURE))
    return Pose(pose.x + dx, pose.y + dy, wrap_angle(pose.yaw + turn)), narrowed
